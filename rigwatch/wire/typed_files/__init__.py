"""Typed TOML files: loaded into declared sections, with errors that name file, key and value."""

from rigwatch.wire.typed_files.bounded import loads
from rigwatch.wire.typed_files.loading import Section, load, parse
from rigwatch.wire.typed_files.shipped import copy_out, find_config, find_file, shipped_names

__all__ = [
    "Section",
    "copy_out",
    "find_config",
    "find_file",
    "load",
    "loads",
    "parse",
    "shipped_names",
]
