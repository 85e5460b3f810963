"""Models as equations: transfer functions, frequency responses and their fits."""
