"""Simulates the rig: its own equations, hidden effects and faults behind real frames."""
