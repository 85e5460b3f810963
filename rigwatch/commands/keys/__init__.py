"""Commands for a rig's authority and certificates."""
