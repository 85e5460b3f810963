"""`rigwatch explain`: ranks the effects that the model may lack and gives a verdict."""

import argparse
from pathlib import Path
from typing import Any

from rigwatch.commands.common import add_studies, print_result, run_studies, say, the_study

HELP = "rank the effects that the model may lack and give a verdict"
EXAMPLE = """\
  rigwatch explain emps
  rigwatch explain 'studies/*' --on local:4 --results verdicts.jsonl"""

RARER = (
    "{count} rarer effects have not been tried: write whole_library = true as the first line of"
    " {file}, then: rigwatch explain {study}"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_studies(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 on success; 1 if some of several studies failed."""
    folder = the_study(arguments)
    if folder is None:
        return run_studies(arguments, "explain", explained, _line)
    return _run_one(arguments, folder)


def explained(folder: Path) -> dict[str, object]:
    """The result of one of several studies, as for one."""
    from rigwatch.workbench.explain import as_data, explain
    from rigwatch.workbench.study import open_study

    return as_data(explain(open_study(folder)))


def _line(found: dict[str, Any]) -> str:
    return f"{found['verdict']}: {found['text']}"


def _run_one(arguments: argparse.Namespace, folder: Path) -> int:
    from rigwatch.workbench.explain import as_data, explain
    from rigwatch.workbench.ranking import suitable
    from rigwatch.workbench.report import explanation_lines, next_command
    from rigwatch.workbench.study import open_study

    study = open_study(folder)
    found = explain(study, progress=say)
    following = next_command(found, f"{folder}")
    rarer = suitable(study)[1] if found.verdict == "unknown_effect" else []
    if rarer:
        following = RARER.format(count=len(rarer), file=folder / "study.toml", study=folder)
    lines = [*explanation_lines(found), *([f"next: {following}"] if following else [])]
    print_result(arguments, as_data(found), lines)
    return 0
