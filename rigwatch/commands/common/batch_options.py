"""Options of every command that goes over several recordings or studies."""

import argparse
import glob
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from rigwatch.commands.common.output import say

if TYPE_CHECKING:
    from rigwatch.batch import Job, Outcome

EXIT_FAILED = 1
_NAMED = 20
"""Most failures that the summary names."""
Finder = Callable[[Path], list[Path]]


def add_many(parser: argparse.ArgumentParser, name: str, help_: str) -> None:
    """The argument for the units, called `name`, and where and how they are worked on."""
    several = f"{help_}; or several, globs and folders"
    parser.add_argument(name, type=_place, nargs="+", help=several)
    add_where(parser)


def _place(text: str) -> Path | str:
    """A path, or an address such as s3://bucket/rigs, which no `Path` may rewrite."""
    return text if "://" in text else Path(text)


def add_where(parser: argparse.ArgumentParser) -> None:
    """Options `--on` and `--results`."""
    add_on(parser)
    parser.add_argument(
        "--results",
        type=Path,
        metavar="FILE",
        help="results as .jsonl or .parquet; a run that was stopped continues",
    )


def add_on(parser: argparse.ArgumentParser) -> None:
    """Option `--on`."""
    parser.add_argument(
        "--on",
        metavar="WHERE",
        help="workers: local:4 (processes of this machine), dask://host:8786, or a file "
        "cluster.toml (dask-jobqueue)",
    )


def the_one(
    arguments: argparse.Namespace, given: list[Path | str], inside: Finder | None = None
) -> Path | None:
    """The only unit that is given, to be treated by itself; None for work over several.

    Args:
        arguments: of the command.
        given: its paths.
        inside: units of a folder, None for recordings.
    """
    first = given[0]
    alone = len(given) == 1 and arguments.on is None and arguments.results is None
    if not alone or isinstance(first, str):
        return None
    if glob.has_magic(str(first)) and not first.exists():
        return None
    return None if _holds_units(first, inside or _recordings) else first


def _holds_units(path: Path, inside: Finder) -> bool:
    """Whether a folder is no unit itself but has some further down."""
    if not path.is_dir():
        return False
    found = inside(path)
    return path not in found and all(unit.parent != path for unit in found) and bool(found)


def _recordings(folder: Path) -> list[Path]:
    from rigwatch.batch import recording_at

    return recording_at(folder)


def run_many(
    arguments: argparse.Namespace,
    given: list[Path | str],
    job: "Job",
    settings: Mapping[str, Any],
    *,
    line: Callable[[Any], str],
    inside: Finder | None = None,
) -> int:
    """Run a job over the units and print a line for each as it comes.

    Args:
        arguments: of the command.
        given: paths, globs and folders; for recordings also addresses of an object store.
        job: what is done with each unit.
        settings: of the job.
        line: a result for people.
        inside: units of a folder, None for recordings.

    Returns:
        0 if every unit has a result, else 1.

    Raises:
        BatchError: the work cannot begin or continue.
    """
    from rigwatch.batch import executor_on, map_recordings

    addresses = [place for place in given if isinstance(place, str)]
    if addresses:
        job, given = _anywhere(job, given, addresses, inside)
    with executor_on(arguments.on) as executor:
        found = map_recordings(
            job,
            given,
            executor=executor,
            results=arguments.results,
            inside=inside or _recordings,
            say=say,
            seen=_Printer(line, as_json=arguments.json),
            **settings,
        )
    _conclude(found.summary(), list(found.failures()), found.file)
    return EXIT_FAILED if found.failed else 0


def _anywhere(
    job: "Job", given: list[Path | str], addresses: list[str], inside: Finder | None
) -> "tuple[Job, list[Path | str]]":
    """The job for recordings in object stores too, and the addresses of all of them.

    Raises:
        BatchError: the units are no recordings.
    """
    from rigwatch.archive import Anywhere, content_anywhere, sessions_at
    from rigwatch.batch import Job
    from rigwatch.wire.errors import BatchError

    if inside is not None:
        raise BatchError(f"{addresses[0]}: only recordings are read from an object store")
    found: list[Path | str] = [place for place in given if isinstance(place, Path)]
    found += [unit for address in addresses for unit in sessions_at(address)]
    return Job(job.name, Anywhere(job.call), content_anywhere, str), found


class _Printer:
    """Prints each outcome as it comes."""

    def __init__(self, line: Callable[[Any], str], *, as_json: bool) -> None:
        self._line, self._as_json = line, as_json

    def __call__(self, outcome: "Outcome") -> None:
        if self._as_json:
            print(_as_json(outcome), flush=True)
        elif not outcome.failed:
            text = self._line(msgspec.json.decode(outcome.value))
            print(f"{outcome.path}: {text}", flush=True)


def _as_json(outcome: "Outcome") -> str:
    if outcome.failed:
        whole: dict[str, Any] = {"kind": outcome.kind, "error": outcome.error}
    else:
        whole = {"result": msgspec.Raw(outcome.value)}
    return msgspec.json.encode({"path": outcome.path, **whole}).decode()


def _conclude(summary: str, failures: "list[Outcome]", file: Path | None) -> None:
    """What was done, and the name of each failure."""
    for outcome in failures[:_NAMED]:
        say(f"failed: {outcome.error}")
    if len(failures) > _NAMED:
        where = f" in {file}" if file else ""
        say(f"and {len(failures) - _NAMED} further failures{where}")
    say(f"{summary}{f'; results in {file}' if file else ''}")
