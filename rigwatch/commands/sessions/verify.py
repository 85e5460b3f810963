"""`rigwatch verify`: replays recorded sessions and compares with stored references."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import print_json

if TYPE_CHECKING:
    from rigwatch.replay import Verdict

HELP = "replay recorded cases and compare every published field with stored references"
EXAMPLE = """\
  rigwatch verify tests/verify/cases.toml
  rigwatch verify tests/verify/cases.toml --update"""
EXIT_DIFFERS = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("cases", type=Path, metavar="CASES", help="file of cases (TOML)")
    parser.add_argument("--update", action="store_true", help="rewrite references that differ")
    parser.add_argument("--only", metavar="NAME", help="only this case")


def run(arguments: argparse.Namespace) -> int:
    """0 if every field agrees with the references or they are rewritten, 1 if one differs."""
    from rigwatch.replay import load_cases, verify
    from rigwatch.wire.errors import ConfigError

    cases = [case for case in load_cases(arguments.cases) if arguments.only in (None, case.name)]
    if not cases:
        raise ConfigError(
            arguments.cases, "case", f"no case {arguments.only!r}", "one of its names"
        )
    folder = arguments.cases.parent
    verdicts = []
    for case in cases:
        verdicts.append(verify(case, folder, update=arguments.update))
        if not arguments.json:
            print("\n".join(_lines(verdicts[-1])), flush=True)
    if arguments.json:
        print_json([_as_data(verdict) for verdict in verdicts])
    return 0 if all(verdict.passed for verdict in verdicts) else EXIT_DIFFERS


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
