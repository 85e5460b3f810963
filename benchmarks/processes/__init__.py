"""Real processes on a real bus: latency, and lost samples."""
