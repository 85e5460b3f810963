"""A year of a rig in an hour."""
