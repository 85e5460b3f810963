"""`rigwatch study view`: the steps of a study in the viewer, a file or a picture."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import print_json, ready_to_draw, say, show_until_closed

if TYPE_CHECKING:
    from rigwatch.dashboard.study_view import Output
    from rigwatch.dashboard.viewer import ForeignViewer, Viewer
    from rigwatch.workbench.steps import Signals, Stage
    from rigwatch.workbench.study import Study


HELP = "show measured and modelled signals of every step: in the viewer, a file or a picture"
EXAMPLE = """\
  rigwatch study view emps
  rigwatch study view emps --save emps.rrd
  rigwatch study view emps --picture emps.png"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument("--save", type=Path, metavar="FILE", help="write a file for Rerun")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="write a picture")


def run(arguments: argparse.Namespace) -> int:
    """0 if it is drawn; returns once a window is closed."""
    ready_to_draw(arguments.save, arguments.picture)
    from rigwatch.workbench.steps import signals, stages
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    say("fitting every step")
    found = stages(study)
    shown = [signals(stage) for stage in found]
    _show(arguments, study, found, shown)
    if arguments.json:
        steps = [stage.label for stage in found]
        print_json({"samples": len(shown[0].time), "steps": steps})
    return 0


def write_picture(draw: "Callable[..., None]", end: float, file: Path) -> None:
    """Draw into a viewer without a window, and write what it shows.

    Args:
        draw: takes the viewer's address.
        end: end of the data [s].
        file: picture file to write.
    """
    from rigwatch.dashboard import recording, study_view

    viewer = recording.headless_viewer()
    try:
        draw(viewer.url, bare=True)
        study_view.take_picture(viewer, end, file)
    finally:
        viewer.stop()


def _show(
    arguments: argparse.Namespace, study: "Study", found: "list[Stage]", shown: "list[Signals]"
) -> None:
    from rigwatch.dashboard import study_view
    from rigwatch.dashboard.drawn_to import drawn_to

    def draw(url: str, *, bare: bool = False) -> None:
        outputs = _outputs(study, found, shown)
        with drawn_to(study.folder.resolve().name, url, arguments.save) as stream:
            study_view.draw_study(stream, shown[0].time, outputs, _story(found), bare=bare)

    if arguments.picture:
        write_picture(draw, float(shown[0].time[-1]), arguments.picture)
        return
    if arguments.save:
        draw("")
        return

    def draw_into(viewer: "Viewer | ForeignViewer") -> str:
        draw(viewer.url)
        return "shown"

    show_until_closed("auto", draw_into, say)


def _outputs(study: "Study", found: "list[Stage]", shown: "list[Signals]") -> "list[Output]":
    from rigwatch.dashboard.study_view import Output

    return [
        Output(
            name,
            output.unit,
            shown[0].measured[:, k],
            {stage.label: s.modelled[:, k] for stage, s in zip(found, shown, strict=True)},
        )
        for k, (name, output) in enumerate(study.model.outputs.items())
    ]


def _story(found: "list[Stage]") -> str:
    rows = [
        f"| {s.label} | {c.told(c.train_error):.4g} | {c.told(c.held_out_error):.4g} |"
        for s, c in ((stage, stage.comparison) for stage in found)
    ]
    last = found[-1].comparison
    head = [f"# Error [{last.told_in}]", "", "| step | training | held out |", "|---|---|---|"]
    floor = f"Noise floor {last.told(last.noise_floor):.4g}, from {last.noise_from}."
    return "\n".join([*head, *rows, "", floor, "", "Signals are of the recordings held out."])
