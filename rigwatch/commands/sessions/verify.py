"""`rigwatch verify`: replays recorded sessions and compares with stored references."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import add_many, print_json, run_many, the_one

if TYPE_CHECKING:
    from rigwatch.replay import Verdict

HELP = "replay recorded cases and compare every published field with stored references"
EXAMPLE = """\
  rigwatch verify tests/verify/cases.toml
  rigwatch verify tests/verify/cases.toml --update
  rigwatch verify 'rigs/*/cases.toml' --on local:4"""
EXIT_DIFFERS = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_many(parser, "cases", "file of cases (TOML)")
    parser.add_argument("--update", action="store_true", help="rewrite references that differ")
    parser.add_argument("--only", metavar="NAME", help="only this case")


def run(arguments: argparse.Namespace) -> int:
    """0 if every field agrees with the references or they are rewritten, 1 if one differs."""
    file = the_one(arguments, arguments.cases, _case_files)
    if file is None:
        return _run_many(arguments)
    verdicts = []
    for verdict in _verdicts(file, arguments.only, update=arguments.update):
        verdicts.append(verdict)
        if not arguments.json:
            print("\n".join(_lines(verdict)), flush=True)
    if arguments.json:
        print_json([_as_data(verdict) for verdict in verdicts])
    return 0 if all(verdict.passed for verdict in verdicts) else EXIT_DIFFERS


def _verdicts(file: Path, only: str | None, *, update: bool) -> "Iterator[Verdict]":
    from rigwatch.replay import load_cases, verify
    from rigwatch.wire.errors import ConfigError

    cases = [case for case in load_cases(file) if only in (None, case.name)]
    if not cases:
        raise ConfigError(file, "case", f"no case {only!r}", "one of its names")
    for case in cases:
        yield verify(case, file.parent, update=update)


def _run_many(arguments: argparse.Namespace) -> int:
    from rigwatch.batch import Job

    job = Job("verify", verified, _content)
    settings = {"only": arguments.only, "update": arguments.update}
    return run_many(arguments, arguments.cases, job, settings, line="\n".join, inside=_case_files)


def verified(file: Path, only: str | None, update: bool) -> list[str]:
    """The verdicts on the cases of one of several files, as lines.

    Raises:
        SessionError: a case differs, or has no reference.
    """
    from rigwatch.wire.errors import SessionError

    verdicts = list(_verdicts(file, only, update=update))
    if failed := [verdict for verdict in verdicts if not verdict.passed]:
        raise SessionError(f"{file}: {'; '.join(line for v in failed for line in _lines(v))}")
    return [line for verdict in verdicts for line in _lines(verdict)]


def _content(file: Path) -> str:
    """Hash of all that lies beside the cases: recordings, models and references."""
    from rigwatch.batch import content_hash

    return content_hash(file.parent)


def _case_files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("cases.toml"))


def _lines(verdict: "Verdict") -> list[str]:
    size = f"{verdict.samples} samples of {verdict.fields} fields"
    if verdict.updated:
        state = "reference renewed"
    elif not verdict.has_reference:
        state = "there is no reference yet, make it with --update"
    else:
        count = len(verdict.differences)
        state = f"{count} fields differ" if count else "as in the reference"
    return [
        f"{verdict.name}: {size}: {state}",
        *(f"  {verdict.name}: {difference}" for difference in verdict.differences),
    ]


def _as_data(verdict: "Verdict") -> dict[str, Any]:
    return {name: getattr(verdict, name) for name in verdict.__slots__} | {"passed": verdict.passed}
