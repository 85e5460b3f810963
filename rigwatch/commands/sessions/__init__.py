"""Commands on session files."""
