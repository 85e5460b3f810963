"""`rigwatch model check`: whether a model's file can work."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.catalogue.curves import plot_lines, save_curves
from rigwatch.commands.common import check_folder, named_values, print_result

if TYPE_CHECKING:
    from rigwatch.physics.engine.equations import Model
    from rigwatch.workbench.catalogue import ModelReport

HELP = "check a model's units, names, ports and observability; draw a run"
EXAMPLE = """\
  rigwatch model check my_rig.toml
  rigwatch model check heated-block --input ambient=293 --save run.svg"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("model", help="a file, or the name of a shipped model")
    parser.add_argument(
        "--input", action="append", default=[], metavar="NAME=VALUE",
        help="value of an input during the run, in the file's unit or one in brackets, such as"
        " q=2[l/min]; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--save", type=Path, metavar="FILE", help="draw the run into FILE.svg, one file an output"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if nothing is in a fit's way, 1 otherwise."""
    from rigwatch.physics.engine.equations import model_named
    from rigwatch.workbench.catalogue import model_report

    check_folder(arguments.save)
    model = model_named(arguments.model)
    units = {name: signal.shown or signal.unit for name, signal in model.inputs.items()}
    inputs = named_values("--input", arguments.input, "u=2.5", units)
    report = model_report(model, inputs, arguments.model)
    lines = [*_lines(arguments.model, report), *_of_run(model, report), *plot_lines(report.run)]
    print_result(arguments, _plain(report), lines)
    if arguments.save:
        save_curves(arguments.save, report.run, lambda curve: f"{arguments.model}: {curve.up}")
    return 0 if report.fine else 1


def _lines(name: str, report: "ModelReport") -> list[str]:
    from rigwatch.workbench.catalogue import findings

    lines = [f"{name}: equations and units are consistent, every port is used in an equation"]
    said = findings(report).values()
    lines += [f"  {', '.join(names)}: {what}" for names, what in said if names]
    ports = ", ".join(f"{count} at {port}" for port, count in report.entering.items())
    lines += [f"  effects that suit its ports: {ports or 'none, as it has no ports'}"]
    return [*lines, *([f"  {report.trouble}"] if report.trouble else [])]


def _of_run(model: "Model", report: "ModelReport") -> list[str]:
    """What the run that is drawn begins with."""
    from rigwatch.workbench.catalogue import inputs_of_run

    if not model.states:
        return ["  no run is drawn: without states the outputs follow the inputs at once"]
    held = inputs_of_run(model, report)
    chosen = f", with {held} (others: --input NAME=VALUE{_differences(model)})" if held else ""
    return [f"  a run from the file's starting values{chosen}:"] if report.run else []


def _differences(model: "Model") -> str:
    """How to give an input in kelvin that is no temperature; empty if none is in kelvin."""
    kelvin = [name for name, own in model.inputs.items() if (own.shown or own.unit) == "K"]
    if not kelvin:
        return ""
    return f"; {', '.join(kelvin)} if a difference, as a warming: --input {kelvin[0]}=20"


def _plain(report: "ModelReport") -> dict[str, object]:
    run = [{"output": c.up, "time": c.x.tolist(), "value": c.y.tolist()} for c in report.run]
    return {**vars(report), "run": run, "fine": report.fine}
