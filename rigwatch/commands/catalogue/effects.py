"""`rigwatch effects`: the library, and one effect with its curves."""

import argparse
from pathlib import Path

from rigwatch.commands.catalogue.curves import plot_lines, save_curves
from rigwatch.commands.common import check_folder, print_result
from rigwatch.wire.errors import RigwatchError

HELP = "list the effects of the library, or describe and draw one"
EXAMPLE = """\
  rigwatch effects
  rigwatch effects dahl
  rigwatch effects dahl --save dahl.svg"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("name", nargs="?", help="one effect; default: all")
    parser.add_argument(
        "--save", type=Path, metavar="FILE", help="draw its curves into FILE.svg, one file a curve"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    if arguments.name is None:
        if arguments.save:
            raise RigwatchError("--save: found no effect to draw, expected its name")
        return _list(arguments)
    return _describe(arguments)


def _describe(arguments: argparse.Namespace) -> int:
    from rigwatch.commands.catalogue.effect_table import described
    from rigwatch.physics.engine.equations import library
    from rigwatch.wire.errors import ModelError, nearest
    from rigwatch.workbench.catalogue import effect_curves

    name, known = arguments.name, library()
    if name not in known:
        raise ModelError(f"effects: found {name!r}{nearest(name, known)}")
    check_folder(arguments.save)
    effect, curves = known[name], effect_curves(known[name])
    data = {"name": name, "effect": effect, "curves": curves}
    print_result(arguments, data, [*described(name, effect), *plot_lines(curves)])
    if arguments.save:
        save_curves(arguments.save, curves, lambda c: f"{name}: {c.up} against {c.across}")
    return 0


def _list(arguments: argparse.Namespace) -> int:
    from rigwatch.commands.catalogue.effect_table import KINDS, RARER, listed

    found = listed()
    lines: list[str] = []
    for kind, effects in found.items():
        lines += [f"{KINDS[kind]}:"]
        lines += (
            f"  {name + RARER * effect.elective:26} {effect.physics}"
            for name, effect in sorted(effects.items())
        )
    lines.append(f"{RARER.strip()} rarer: tried with whole_library = true in the study")
    print_result(arguments, found, lines)
    return 0
