"""Stands in for the rig: its own equations, hidden effects and faults behind real frames."""
