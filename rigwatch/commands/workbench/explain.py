"""`rigwatch explain`: ranks the effects that the model may lack and gives a verdict."""

import argparse
from pathlib import Path
from typing import Any

from rigwatch.commands.common import add_studies, print_result, run_studies, say, the_study

HELP = "rank the effects that the model may lack and give a verdict"
EXAMPLE = """\
  rigwatch explain emps
  rigwatch explain rubbing --whole-library
  rigwatch explain 'studies/*' --on local:4 --results verdicts.jsonl"""

RARER = "{count} rarer effects have not been tried: rigwatch explain {study} --whole-library"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_studies(parser)
    parser.add_argument(
        "--whole-library",
        action="store_true",
        help="also rank the library's rarer effects, as whole_library = true in the study does;"
        " without a healthy recording they are tried by themselves where no usual one explains it",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success; 1 if some of several studies failed."""
    folder = the_study(arguments)
    if folder is None:
        more = {"whole_library": True} if arguments.whole_library else {}
        return run_studies(arguments, "explain", explained, _line, **more)
    return _run_one(arguments, folder)


def explained(folder: Path, *, whole_library: bool = False) -> dict[str, object]:
    """The result of one of several studies, as for one."""
    from rigwatch.workbench.explain import as_data, explain, with_whole_library
    from rigwatch.workbench.study import open_study

    study = open_study(folder)
    return as_data(explain(with_whole_library(study) if whole_library else study))


def _line(found: dict[str, Any]) -> str:
    return f"{found['verdict']}: {found['text']}"


def _run_one(arguments: argparse.Namespace, folder: Path) -> int:
    from rigwatch.workbench.data import predicts_along_motion
    from rigwatch.workbench.explain import as_data, explain, tries_rarer, with_whole_library
    from rigwatch.workbench.ranking import suitable
    from rigwatch.workbench.report import explanation_lines, next_step
    from rigwatch.workbench.study import open_study

    study = open_study(folder)
    if arguments.whole_library:
        study = with_whole_library(study)
    found = explain(study, progress=say)
    following = next_step(found, f"{folder}")
    tries = tries_rarer(study, along_motion=predicts_along_motion(study))
    waiting = not (found.tried_rarer or tries)
    rarer = suitable(study)[1] if found.verdict == "unknown_effect" and waiting else []
    if rarer:
        following = RARER.format(count=len(rarer), study=folder)
    lines = [*explanation_lines(found), *([f"next: {following}"] if following else [])]
    print_result(arguments, as_data(found), lines)
    return 0
