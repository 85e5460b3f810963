"""`rigwatch add`: adds an effect to a study's model, if the held-out recordings support it."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result, say

HELP = "add an effect to the model of a study and refit; refused unless the held-out error falls"
EXAMPLE = """\
  rigwatch add emps coulomb
  rigwatch add emps offset@force_sensor
  rigwatch add motor viscous_by_direction --with saturation@drive coulomb@shaft
  rigwatch add emps --effect-file my_effects.toml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "effect", nargs="?", metavar="EFFECT[@PORT]", help="the effect, as the ranking names it"
    )
    parser.add_argument("--port", help="port where it acts, if several are possible")
    parser.add_argument(
        "--anyway", action="store_true", help="add it even though the held-out error does not fall"
    )
    parser.add_argument(
        "--with",
        dest="beside",
        nargs="+",
        default=[],
        metavar="EFFECT@PORT",
        help="effects that are missing as well: if refused alone, it is added if the whole set"
        " lowers the held-out error, and each effect of it with the others in the model",
    )
    parser.add_argument(
        "--effect-file",
        type=Path,
        metavar="TOML",
        help="file of own effects: copied into the study and ranked with the others",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the effect is added, 1 if refused."""
    from rigwatch.wire.errors import ModelError
    from rigwatch.workbench.report import change_lines
    from rigwatch.workbench.steps import add, learn
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    if arguments.effect_file is not None:
        study, names = learn(study, arguments.effect_file)
        if arguments.effect is None:
            text = f"{study.folder}: will be ranked with the others: {', '.join(names)}"
            print_result(arguments, {"step": "effect-file", "effects": names}, text)
            return 0
    if arguments.effect is None:
        raise ModelError("add: found no effect, expected its name, or --effect-file")
    change = add(
        study, arguments.effect, arguments.port, anyway=arguments.anyway,
        beside=arguments.beside, progress=say,
    )  # fmt: skip
    print_result(arguments, change, change_lines(change))
    return 1 if change.step == "refused" else 0
