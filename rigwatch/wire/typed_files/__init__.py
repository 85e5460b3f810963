"""Typed files: TOML loaded into declared sections, with errors that name file, key and value; JSON
as typed values.
"""

from rigwatch.wire.typed_files.bounded import loads
from rigwatch.wire.typed_files.json_values import JsonError, as_json, decoded, json_value
from rigwatch.wire.typed_files.loading import Section, converted, load, parse, read_text
from rigwatch.wire.typed_files.overlay import files_of, holder, load_layered, whole_text
from rigwatch.wire.typed_files.prepared import as_kind, json_decoder
from rigwatch.wire.typed_files.shipped import copy_out, find_config, find_file, shipped_names
from rigwatch.wire.typed_files.writing import as_toml, quoted

__all__ = [
    "JsonError",
    "Section",
    "as_json",
    "as_kind",
    "as_toml",
    "converted",
    "copy_out",
    "decoded",
    "files_of",
    "find_config",
    "find_file",
    "holder",
    "json_decoder",
    "json_value",
    "load",
    "load_layered",
    "loads",
    "parse",
    "quoted",
    "read_text",
    "shipped_names",
    "whole_text",
]
