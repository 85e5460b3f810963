"""The monitor over recordings: replayed for people, and compared with references in CI."""
