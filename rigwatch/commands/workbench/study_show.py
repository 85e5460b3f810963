"""`rigwatch study show`: a study's model and its ledger."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import print_json

if TYPE_CHECKING:
    from rigwatch.workbench.study import Study

HELP = "show the model of a study, its effects and every step so far"
EXAMPLE = "  rigwatch study show emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.study import ledger, open_study

    study = open_study(arguments.study)
    steps = list(ledger.lines(study))
    if arguments.json:
        print_json(
            {
                "model": study.model.name,
                "known": study.known,
                "effects": study.file.effects,
                "ledger": steps,
            }
        )
        return 0
    print("\n".join([*_model_lines(study), *_step_lines(study, steps)]))
    return 0


def _model_lines(study: "Study") -> list[str]:
    """The model with its variants, known and moving parameters and accepted effects."""
    from rigwatch.workbench.study import physics_of

    lines = [f"{study.folder}: model {study.model.name}: {study.model.summary}"]
    lines += [f"  with {name}: {physics_of(study, name)}" for name in study.file.variants]
    lines += [f"  known of {one}" for one in study.known]
    if moving := study.moving():
        lines.append(f"  fitted per recording: {', '.join(moving)}")
    for accepted in study.file.effects:
        physics = study.effects[accepted.effect].physics
        lines.append(f"  + {accepted.effect}@{accepted.port}: {physics}")
    return lines


def _step_lines(study: "Study", steps: "Sequence[Mapping[str, Any]]") -> list[str]:
    """A table of the ledger, with errors in the unit in which the other commands tell them."""
    from rigwatch.workbench.report import number, table
    from rigwatch.workbench.study import told

    rows = []
    for line in steps:
        unit = _told_unit(study, line.get("unit", ""))
        errors = [line.get("train_error"), line.get("held_out_error")]
        shown = [None if error is None else told(error, unit) for error in errors]
        effect = f"{line['effect']}@{line['port']}" if "effect" in line else ""
        rows.append([line["time"], line["step"], effect, *map(number, shown), unit])
    return table(["time", "step", "effect", "training", "held out", "unit"], rows)


def _told_unit(study: "Study", kept: str) -> str:
    """The unit that tells errors which the ledger keeps in another: that of the only output."""
    from rigwatch.workbench.study import told_unit

    outputs = list(study.model.outputs.values())
    alone = len(outputs) == 1 and outputs[0].unit == kept
    return told_unit(outputs[0]) if alone else kept
