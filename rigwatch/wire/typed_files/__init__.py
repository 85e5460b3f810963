"""Typed TOML files: loaded into declared sections, with errors that name file, key and value."""

from rigwatch.wire.typed_files.bounded import loads
from rigwatch.wire.typed_files.loading import Section, load, parse

__all__ = ["Section", "load", "loads", "parse"]
