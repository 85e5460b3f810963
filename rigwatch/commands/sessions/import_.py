"""`rigwatch import`: makes sessions from CSV, MAT, Parquet or JSON files."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import (
    LOGS,
    add_log_columns,
    add_many,
    file_or_name,
    print_json,
    run_many,
    say,
    the_one,
    whole,
)
from rigwatch.wire.errors import ImportDataError

if TYPE_CHECKING:
    from rigwatch.wire.exchange import Imported, ImportMapping

HELP = "import CSV, MAT, Parquet or JSON files as sessions"
EXAMPLE = """\
  rigwatch import DATA_EMPS.mat emps.mcap --mapping emps
  rigwatch import run.csv run.mcap --time 't[ms]' --map 'position=qm[mm]' --map 'force=u*35.15[N]'
  rigwatch import exported.csv run.mcap
  rigwatch import 'logs/*.csv' sessions --on local:4 --results imported.jsonl"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_many(parser, "source", "the file to import")
    help_ = "the new session file (.mcap); of several, the folder for them"
    parser.add_argument("target", type=Path, help=help_)
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
        "--skip-rows", type=whole(0), metavar="N", help="number of rows to skip at the start"
    )
    parser.add_argument(
        "--delimiter", help="separator of CSV cells: auto, whitespace, or a character"
    )
    parser.add_argument("--start", metavar="TIME", help="ISO time of zero in the time column")
    parser.add_argument(
        "--flag-missing", action="store_true", default=None, help="accept NaN as invalid samples"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the session is written, or all of several; 1 if some of several are not."""
    source = the_one(arguments, arguments.source, tables_in)
    if source is None or arguments.target.is_dir():
        return _run_many(arguments)
    made = _imported(source, arguments.target, _mapping(arguments), arguments.start)
    if arguments.json:
        print_json(made)
        return 0
    print(f"{made.path}: {_size(made.samples, made.rate_hz, made.channels)}")
    for remark in made.remarks:
        say(remark)
    return 0


def _imported(
    source: Path, target: Path, mapping: "ImportMapping", start: str | None
) -> "Imported":
    from rigwatch.commands.common import unix_time
    from rigwatch.wire.exchange import import_file

    return import_file(source, target, mapping, unix_time(start, "--start") if start else 0)


def _size(samples: int, rate_hz: float, channels: dict[str, str]) -> str:
    named = ", ".join(f"{name} [{unit}]" for name, unit in channels.items())
    return f"{samples} samples at {rate_hz:g} Hz of {named}"


def _run_many(arguments: argparse.Namespace) -> int:
    import msgspec

    from rigwatch.batch import Job, expand

    folder = arguments.target
    if not folder.is_dir():
        raise ImportDataError(f"{folder}: found no such folder, expected one for several sessions")
    if all(isinstance(place, Path) for place in arguments.source):
        _check_targets(folder, expand(arguments.source, tables_in))
    mapping = msgspec.to_builtins(_mapping(arguments))
    settings = {"folder": str(folder.resolve()), "mapping": mapping, "start": arguments.start}
    job = Job("import", imported)
    return run_many(arguments, arguments.source, job, settings, line=_line, inside=tables_in)


def imported(
    source: Path, folder: str, mapping: dict[str, Any], start: str | None
) -> dict[str, Any]:
    """One of several files as a session in a folder, whole or not at all; what was made."""
    import msgspec

    from rigwatch.wire.exchange import ImportMapping
    from rigwatch.wire.typed_files import as_kind

    target = _target(Path(folder), source)
    made = _imported(source, target, as_kind(mapping, ImportMapping), start)
    found: dict[str, Any] = msgspec.to_builtins(made, enc_hook=str)
    return found


def _line(found: dict[str, Any]) -> str:
    size = _size(found["samples"], found["rate_hz"], found["channels"])
    return "; ".join([f"{found['path']}: {size}", *found["remarks"]])


def tables_in(folder: Path) -> list[Path]:
    """The tables in a folder, at any depth."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in LOGS)


def _target(folder: Path, source: Path) -> Path:
    return folder / f"{source.stem}.mcap"


def _check_targets(folder: Path, sources: list[str]) -> None:
    """Raise if two files would become the same session."""
    made: dict[Path, str] = {}
    for source in sources:
        other = made.setdefault(_target(folder, Path(source)), source)
        if other != source:
            name = _target(folder, Path(source))
            raise ImportDataError(f"{source}, {other}: both become {name}, expected other names")


def _mapping(arguments: argparse.Namespace) -> "ImportMapping":
    """The mapping file's content, overridden by the options."""
    import msgspec

    from rigwatch.wire.exchange import ImportMapping, parse_map_option
    from rigwatch.wire.typed_files import converted, load

    mapping = load(arguments.mapping, ImportMapping) if arguments.mapping else ImportMapping()
    given: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in ("time", "rate", "device", "rig", "skip_rows", "delimiter", "flag_missing")
        if getattr(arguments, name) is not None
    }
    if arguments.columns:
        given["columns"] = tuple(arguments.columns.split(","))
    given["channels"] = mapping.channels | dict(map(parse_map_option, arguments.map))
    merged = msgspec.to_builtins(msgspec.structs.replace(mapping, **given))
    return converted(merged, ImportMapping, "options of import")
