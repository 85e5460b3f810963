"""`rigwatch study base`: the study's base model: variants that the data support, or an own file."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import print_json, print_result, say

if TYPE_CHECKING:
    from rigwatch.workbench.study import Study

HELP = "rank the model's variants by the healthy recordings, or replace the model file"
EXAMPLE = """\
  rigwatch study base rubbing
  rigwatch study base rubbing --take first_order_valve,isothermal
  rigwatch study base rubbing --take enough
  rigwatch study base rubbing --model-file my_rig.toml"""
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
    parser.add_argument(
        "--model-file",
        type=Path,
        metavar="TOML",
        help="your own model file, copied into the study and used from then on",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.steps import take_base
    from rigwatch.workbench.study import open_study

    study, wanted = open_study(arguments.study), arguments.take
    if arguments.model_file is not None:
        study = _remodelled(study, arguments)
        if wanted is None:
            return 0
    if wanted in (None, ENOUGH):
        return _found(study, arguments)
    names = [] if wanted == WRITTEN else [name.strip() for name in wanted.split(",")]
    take_base(study, names)
    print_result(arguments, {"step": "base", "variants": names}, _taken(study, names))
    return 0


def _remodelled(study: "Study", arguments: argparse.Namespace) -> "Study":
    from rigwatch.wire.typed_files import read_text
    from rigwatch.workbench.steps import remodel

    file = arguments.model_file
    changed = remodel(study, file.name, read_text(file))
    if not arguments.json:
        print(f"{study.folder}: uses {changed.model.name} of {file.name}")
    elif arguments.take is None:
        print_json({"step": "model-file", "file": file.name, "model": changed.model.name})
    return changed


def _found(study: "Study", arguments: argparse.Namespace) -> int:
    """Ranks the bases and takes the best if asked to."""
    from rigwatch.workbench.compare import find_base
    from rigwatch.workbench.report import base_lines
    from rigwatch.workbench.steps import take_base

    found = find_base(study, progress=say)
    names = found.enough.variants
    if arguments.take:
        take_base(study, names)
    lines = base_lines(found)
    if arguments.take:
        lines.append(_taken(study, names))
    elif set(names) != set(study.file.variants):
        lines.append(f"to take it: rigwatch study base {arguments.study} --take {ENOUGH}")
    print_result(arguments, found, lines)
    return 0


def _taken(study: "Study", names: Sequence[str]) -> str:
    return f"{study.folder}: base with {', '.join(names) or 'no variants'}"
