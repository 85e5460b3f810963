"""`rigwatch import`: makes a session from a CSV, MAT, Parquet or JSON file."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import add_log_columns, file_or_name, print_json, say

if TYPE_CHECKING:
    from rigwatch.wire.exchange import ImportMapping

HELP = "make a session from a CSV, MAT, Parquet or JSON file"
EXAMPLE = """\
  rigwatch import DATA_EMPS.mat emps.mcap --mapping emps
  rigwatch import run.csv run.mcap --time 't[ms]' --map 'position=qm[mm]' --map 'force=u*35.15[N]'
  rigwatch import exported.csv run.mcap"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("source", type=Path, help="the file to import")
    parser.add_argument("target", type=Path, help="the new session file (.mcap)")
    parser.add_argument(
        "--mapping",
        type=file_or_name("imports"),
        metavar="TOML",
        help="column mapping, or the name of a shipped one",
    )
    add_log_columns(parser)
    parser.add_argument("--device", help="the device's name in the session")
    parser.add_argument("--rig", help="the rig's id in the session")
    parser.add_argument(
        "--skip-rows", type=int, metavar="N", help="number of rows to skip at the start"
    )
    parser.add_argument(
        "--delimiter", help="separator of CSV cells: auto, whitespace, or a character"
    )
    parser.add_argument("--start", metavar="TIME", help="ISO time of zero in the time column")
    parser.add_argument(
        "--flag-missing", action="store_true", default=None, help="accept NaN as invalid samples"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the session is written."""
    from rigwatch.commands.common import unix_time
    from rigwatch.wire.exchange import import_file

    start_ns = unix_time(arguments.start, "--start") if arguments.start else 0
    made = import_file(arguments.source, arguments.target, _mapping(arguments), start_ns)
    if arguments.json:
        print_json(made)
        return 0
    channels = ", ".join(f"{name} [{unit}]" for name, unit in made.channels.items())
    print(f"{made.path}: {made.samples} samples at {made.rate_hz:g} Hz of {channels}")
    for remark in made.remarks:
        say(remark)
    return 0


def _mapping(arguments: argparse.Namespace) -> "ImportMapping":
    """The mapping file's content, overridden by the options."""
    import msgspec

    from rigwatch.wire.errors import ImportDataError
    from rigwatch.wire.exchange import ImportMapping, parse_map_option
    from rigwatch.wire.typed_files import load

    mapping = load(arguments.mapping, ImportMapping) if arguments.mapping else ImportMapping()
    given: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in ("time", "rate", "device", "rig", "skip_rows", "delimiter", "flag_missing")
        if getattr(arguments, name) is not None
    }
    if arguments.columns:
        given["columns"] = tuple(arguments.columns.split(","))
    given["channels"] = mapping.channels | dict(map(parse_map_option, arguments.map))
    try:
        merged = msgspec.to_builtins(msgspec.structs.replace(mapping, **given))
        return msgspec.convert(merged, ImportMapping)
    except msgspec.ValidationError as error:
        raise ImportDataError(f"options of import: {error}") from None
