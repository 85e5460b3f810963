"""The recorder process: everything on the bus that is worth keeping goes into session files."""
