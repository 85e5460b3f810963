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


def write_views(draw: Callable[..., None], end: float, picture: Path | None) -> None:
    """Draw into a headless viewer for a picture, else into a file.

    Args:
        draw: takes the viewer's address, "" for the file.
        end: end of the data [s].
        picture: picture file to write.
    """
    from rigwatch.dashboard import recording, study_view

    if picture is None:
        draw("")
        return
    viewer = recording.headless_viewer()
    try:
        draw(viewer.url, bare=True)
        study_view.take_picture(viewer, end, picture)
    finally:
        viewer.stop()


def _show(
    arguments: argparse.Namespace, study: "Study", found: "list[Stage]", shown: "list[Signals]"
) -> None:
    from rigwatch.dashboard import study_view
    from rigwatch.dashboard.drawn_to import drawn_to

    def draw(url: str, *, bare: bool = False) -> None:
        stream = study_view.new_stream(study.folder.resolve().name)
        outputs = _outputs(study, found, shown)
        with drawn_to(stream, url, arguments.save):
            study_view.draw_study(stream, shown[0].time, outputs, _story(found), bare=bare)

    if arguments.picture or arguments.save:
        write_views(draw, float(shown[0].time[-1]), arguments.picture)
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
        f"| {s.label} | {s.comparison.train_error:.4g} | {s.comparison.held_out_error:.4g} |"
        for s in found
    ]
    last = found[-1].comparison
    head = [f"# Error [{last.unit}]", "", "| step | training | held out |", "|---|---|---|"]
    floor = f"Noise floor {last.noise_floor:.4g}, from {last.noise_from}."
    return "\n".join([*head, *rows, "", floor, "", "Signals are of the recordings held out."])
