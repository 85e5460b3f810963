"""Malformed input: files, messages and requests."""
