"""Plots of a study with matplotlib, for notebooks and papers."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rigwatch.wire.errors import MissingExtraError, ModelError, nearest
from rigwatch.workbench.compare import locate
from rigwatch.workbench.report import motion_units, residual_over_motion
from rigwatch.workbench.steps import Stage
from rigwatch.workbench.steps import signals as signals_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

try:
    from matplotlib import pyplot
except ImportError:
    raise MissingExtraError("matplotlib", "notebook", "plotting") from None


def signals(stage: Stage, channel: str = "") -> "Figure":
    """Measured and modelled output, and the residual below with the noise floor.

    Args:
        stage: the model.
        channel: the output; the first if empty.

    Raises:
        ModelError: the model has no output of that name.
    """
    index, name, unit = _output(stage, channel)
    found = signals_of(stage)
    figure, (above, below) = pyplot.subplots(2, sharex=True, layout="constrained")
    above.plot(found.time, found.measured[:, index], label="measured")
    above.plot(found.time, found.modelled[:, index], "--", label="modelled")
    above.set_ylabel(f"{name} [{unit}]")
    above.legend()
    floor = float(stage.bench.floor.rms[index])
    below.axhspan(-floor, floor, alpha=0.3, color="grey", label="noise floor")
    below.plot(found.time, found.residual[:, index], label="residual")
    below.set_ylabel(f"residual [{unit}]")
    below.set_xlabel("time [s]")
    below.legend()
    return figure


def where(stage: Stage, channel: str = "") -> "Figure":
    """Mean residual over position and velocity, or over time if the model has no motion.

    Args:
        stage: the model.
        channel: the output; the first if empty.

    Raises:
        ModelError: the model has no output of that name.
    """
    index, name, unit = _output(stage, channel)
    grid = residual_over_motion(stage, index)
    figure, axes = pyplot.subplots(layout="constrained")
    if grid is None:
        regions = [r for r in locate(stage.bench) if (r.channel, r.view) == (name, "time")]
        ordered = sorted(regions, key=lambda region: int(region.samples[0]))
        axes.barh([region.name for region in ordered], [region.rms for region in ordered])
        axes.set_xlabel(f"rms of the residual of {name} [{unit}]")
        return figure
    x, v, means, counts = grid
    shown = np.where(counts > 0, means, np.nan).T
    most = float(np.nanmax(np.abs(shown)))
    drawn = axes.pcolormesh(x, v, shown, cmap="RdBu_r", vmin=-most, vmax=most)
    figure.colorbar(drawn, label=f"mean residual of {name} [{unit}]")
    units = motion_units(stage)
    axes.set_xlabel(f"position [{units[0]}]")
    axes.set_ylabel(f"velocity [{units[1]}]")
    return figure


def steps(stages: Sequence[Stage]) -> "Figure":
    """Errors of each step against the noise floor."""
    figure, axes = pyplot.subplots(layout="constrained")
    labels = [stage.label for stage in stages]
    found = [stage.comparison for stage in stages]
    axes.plot(labels, [c.told(c.held_out_error) for c in found], "o-", label="held out")
    axes.plot(labels, [c.told(c.train_error) for c in found], "s--", label="training")
    floors = [c.told(c.noise_floor) for c in found]
    axes.plot(labels, floors, ":", color="grey", label="noise floor")
    axes.set_ylabel(f"error [{found[0].told_in}]")
    axes.set_ylim(bottom=0)
    axes.legend()
    return figure


def _output(stage: Stage, channel: str) -> tuple[int, str, str]:
    """Number, name and unit of an output."""
    outputs = stage.bench.study.model.outputs
    name = channel or next(iter(outputs))
    if name not in outputs:
        raise ModelError(f"channel: found {name!r}{nearest(name, outputs)}")
    return list(outputs).index(name), name, outputs[name].unit
