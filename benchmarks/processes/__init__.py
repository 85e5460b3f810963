"""Real processes on a real bus: latency, and samples that are lost."""
