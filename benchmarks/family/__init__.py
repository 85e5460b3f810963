"""Rigs as folders of recordings, played through the commands."""
