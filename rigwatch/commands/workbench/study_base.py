"""`rigwatch study base`: which variants of the model the healthy recordings support."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import print_json, say

if TYPE_CHECKING:
    from rigwatch.workbench.study import Study

HELP = "fit the model's variants to the healthy recordings and rank them on those held out"
EXAMPLE = """\
  rigwatch study base rubbing
  rigwatch study base rubbing --take first_order_valve,isothermal
  rigwatch study base rubbing --take enough"""
ENOUGH, WRITTEN = "enough", "none"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--take",
        metavar="NAMES",
        help="write these variants, separated by commas, to the study; `enough`: those that the"
        " healthy recordings support; `none`: the unmodified model",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.steps import take_base
    from rigwatch.workbench.study import open_study

    study, wished = open_study(arguments.study), arguments.take
    if wished in (None, ENOUGH):
        return _found(study, arguments)
    names = [] if wished == WRITTEN else [name.strip() for name in wished.split(",")]
    take_base(study, names)
    if arguments.json:
        print_json({"step": "base", "variants": names})
    else:
        print(_taken(study, names))
    return 0


def _found(study: "Study", arguments: argparse.Namespace) -> int:
    """Ranks the bases and takes the best if asked to."""
    from rigwatch.workbench.report import base_lines
    from rigwatch.workbench.steps import find_base, take_base

    found = find_base(study, progress=say)
    names = found.enough.variants
    if arguments.take:
        take_base(study, names)
    if arguments.json:
        print_json(found)
        return 0
    print("\n".join(base_lines(found)))
    if arguments.take:
        print(_taken(study, names))
    elif set(names) != set(study.file.variants):
        print(f"to take it: rigwatch study base {arguments.study} --take {ENOUGH}")
    return 0


def _taken(study: "Study", names: Sequence[str]) -> str:
    return f"{study.folder}: base with {', '.join(names) or 'no variants'}"
