"""The dashboard process: what the rig does, live or from a recording, drawn with Rerun."""
