"""`rigwatch effects`: the library, and one effect with its curves."""

import argparse
from pathlib import Path

from rigwatch.commands.common import check_folder, print_json, say

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
    from rigwatch.physics.engine.equations import library
    from rigwatch.wire.errors import ModelError, nearest
    from rigwatch.wire.new_file import write_new
    from rigwatch.workbench.catalogue import described, effect_curves, plotted, text_plot

    name, known = arguments.name, library()
    if name is None:
        return _list(arguments)
    if name not in known:
        raise ModelError(f"effects: found {name!r}{nearest(name, known)}")
    check_folder(arguments.save)
    effect, curves = known[name], effect_curves(known[name])
    if arguments.json:
        print_json({"name": name, "effect": effect, "curves": [_plain(c) for c in curves]})
    else:
        print("\n".join(described(name, effect)))
        for curve in curves:
            print("\n" + "\n".join(text_plot(curve)))
    if arguments.save:
        for number, curve in enumerate(curves):
            file = arguments.save.with_suffix("")
            file = file.with_name(f"{file.name}{f'_{number + 1}' if number else ''}.svg")
            drawn = plotted(curve, f"{name}: {curve.up} against {curve.across}")
            write_new(file, drawn, replace=True)
            say(f"drawn: {file}")
    return 0


def _list(arguments: argparse.Namespace) -> int:
    from rigwatch.workbench.catalogue import KINDS, listed

    found = listed()
    if arguments.json:
        print_json(found)
        return 0
    for kind, effects in found.items():
        print(f"{KINDS[kind]}:")
        for name, effect in sorted(effects.items()):
            print(f"  {name:24} {effect.physics}")
    return 0


def _plain(curve: object) -> dict[str, object]:
    return {
        key: value.tolist() if hasattr(value, "tolist") else value
        for key, value in vars(curve).items()
    }
