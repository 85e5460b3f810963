"""`--save` and `--picture` of `rigwatch structure`: measurement, model and conclusions."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import ready_to_draw, say
from rigwatch.commands.structures.structure_files import figures

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rigwatch.dashboard.study_view import Judged, Output
    from rigwatch.structures.damage import Damage, Examination
    from rigwatch.structures.identification import Identification, Problem

SHOWN = 5
"""Number of candidate places listed."""
SIGHT = 5.0
"""Largest modelled value drawn, in multiples of the largest measured one."""


def add_views(parser: argparse.ArgumentParser) -> None:
    """Arguments that draw into files."""
    parser.add_argument("--save", type=Path, metavar="FILE.rrd", help="write a file for Rerun")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="write a picture of it")


def wanted(arguments: argparse.Namespace) -> bool:
    """Whether to draw; checks early that it is possible.

    Raises:
        MissingExtraError: Rerun is not installed.
        SessionError: a file's folder does not exist.
    """
    if not (arguments.save or arguments.picture):
        return False
    ready_to_draw(arguments.save, arguments.picture)
    return True


def draw_damage(arguments: argparse.Namespace, found: "Examination") -> None:
    """The examined record: signals, residuals, the test, instants and verdict."""
    import numpy as np

    from rigwatch.dashboard.study_view import Judged, Output
    from rigwatch.structures.damage import signals as damage_signals
    from rigwatch.structures.report import verdict

    model = found.reference.model
    series = damage_signals.modelled(found)
    words, sizes = damage_signals.band(found)
    units = model.problem.system.model.outputs
    outputs = [
        Output(
            name, units[name].unit, model.observed[:, k],
            {step: values[:, k] for step, values in series.items()}, (words, float(sizes[k])),
        )
        for k, name in enumerate(model.signals)
    ]  # fmt: skip
    loudest = np.argsort(-damage_signals.loudness(found), kind="stable")
    instants = {
        f"{', '.join(c.name for c in d.ranking.changed)} {d.instant.time:.3f} s": d.instant.time
        for d in found.damages
    }
    judged = Judged(damage_signals.statistic(found), instants)
    lines = [line for damage in found.damages for line in damage_lines(damage)]
    story = _story(f"{model.structure.name}: {verdict(found)}", lines)
    seconds = np.arange(len(model)) * np.float64(model.dt)
    _draw(arguments, seconds, [outputs[k] for k in loudest], story, judged)


def damage_lines(damage: "Damage") -> list[str]:
    """The description of a damage."""
    at = damage.instant
    vague = "" if damage.explained else ", not explained by one change or two"
    both = ", two changes at once" if damage.ranking.second else ""
    lines = [
        f"damage noticed at {damage.alarm:.3f} s{vague}{both}",
        f"  happened at {at.time:.3f} s [{at.low:.3f}, {at.high:.3f}]",
    ]
    for place in damage.ranking.candidates[:SHOWN]:
        alike = f"  (cannot be told from {', '.join(place.alike)})" if place.alike else ""
        lines.append(f"  {place.name:<16} {place.before:>11.5g} -> {place.after:<11.5g}{alike}")
    for name, figure in damage.figures.items():
        lines.append(f"  {name} = {figure.value:.6g} [{figure.low:.6g}, {figure.high:.6g}]")
    return lines


def draw_methods(
    arguments: argparse.Namespace, problem: "Problem", results: "Mapping[str, Identification | str]"
) -> None:
    """The results of methods: signals, residuals, unknowns.

    A result is that of a method, or its error message.
    """
    import numpy as np

    from rigwatch.dashboard.study_view import Output
    from rigwatch.structures.identification import modelled, seconds_of

    model, observed = problem.system.model, problem.observed
    made = {m: modelled(problem, r) for m, r in results.items() if not isinstance(r, str)}
    outputs = [
        Output(
            name, output.unit, observed[:, k],
            {method: _kept(values[:, k], observed[:, k]) for method, values in made.items()},
        )
        for k, (name, output) in enumerate(model.outputs.items())
        if np.isfinite(observed[:, k]).any()
    ]  # fmt: skip
    story = "\n\n".join(_method(model.name, method, r) for method, r in results.items())
    _draw(arguments, seconds_of(problem), outputs, story)


def _method(model: str, method: str, result: "Identification | str") -> str:
    if isinstance(result, str):
        return _story(f"{model}: {method} failed", [result])
    state = "converged" if result.converged else "did not converge"
    title = f"{model}: {method} {state} in {len(result.iterations)} iterations"
    return _story(title, [*figures(result), *result.remarks])


def _kept(values: "NDArray[np.float64]", measured: "NDArray[np.float64]") -> "NDArray[np.float64]":
    """A signal, clipped near the measured range; a method may diverge."""
    import numpy as np

    near = np.abs(values) <= SIGHT * np.nanmax(np.abs(measured))
    return np.where(near, values, np.nan)


def _story(title: str, lines: Sequence[str]) -> str:
    """Markdown: a title, and verbatim lines."""
    stripped = [line.rstrip() for line in lines]
    return "\n".join([f"# {title}", "", *(["```", *stripped, "```"] if lines else [])])


def _draw(
    arguments: argparse.Namespace,
    seconds: "NDArray[np.float64]",
    outputs: "list[Output]",
    story: str,
    judged: "Judged | None" = None,
) -> None:
    from rigwatch.commands.workbench import write_picture
    from rigwatch.dashboard import study_view
    from rigwatch.dashboard.drawn_to import drawn_to

    def draw(url: str, *, bare: bool = False) -> None:
        with drawn_to(arguments.record.stem, url, arguments.save) as stream:
            study_view.draw_study(stream, seconds, outputs, story, judged=judged, bare=bare)

    if arguments.save:
        draw("")
        say(f"drawn: {arguments.save}")
    if arguments.picture:
        write_picture(draw, float(seconds[-1]), arguments.picture)
        say(f"drawn: {arguments.picture}")
