"""`rigwatch study show`: a study's model and its ledger."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

HELP = "show the model of a study, its effects and every step so far"
EXAMPLE = "  rigwatch study show emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.report import number, table
    from rigwatch.workbench.study import ledger, open_study, physics_of

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
    print(f"{study.folder}: model {study.model.name}: {study.model.summary}")
    for name in study.file.variants:
        print(f"  with {name}: {physics_of(study, name)}")
    for one in study.known:
        print(f"  known of {one}")
    if moving := study.moving():
        print(f"  fitted per recording: {', '.join(moving)}")
    for accepted in study.file.effects:
        print(f"  + {accepted.effect}@{accepted.port}: {study.effects[accepted.effect].physics}")
    rows = [
        [
            line["time"],
            line["step"],
            f"{line['effect']}@{line['port']}" if "effect" in line else "",
            number(line.get("train_error")),
            number(line.get("held_out_error")),
            line.get("unit", ""),
        ]
        for line in steps
    ]
    print("\n".join(table(["time", "step", "effect", "training", "held out", "unit"], rows)))
    return 0
