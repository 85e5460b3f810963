"""The report's charts: each function takes results of a study and returns one <svg>."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from rigwatch.page import Plot, limits
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Region, motion, sample_numbers
from rigwatch.workbench.steps import Signals, Stage

CELLS = 22
NARROW = 6
"""Number of bars that fit into half the page's width."""
CROSSINGS = 8
"""Number of mean crossings of the measured signal in the section shown."""


@dataclass(frozen=True)
class Refused:
    """An effect that was tried and refused.

    Attributes:
        label: "effect@port".
        after: number of effects in the model at that time.
        held_out_error: with the effect.
    """

    label: str
    after: int
    held_out_error: float


def error_chart(stages: Sequence[Stage], refused: Sequence[Refused]) -> str:
    """Errors of every stage against the noise floor."""
    at = np.arange(len(stages), dtype=float)
    found = [stage.comparison for stage in stages]
    train = np.array([c.told(c.train_error) for c in found])
    held_out = np.array([c.told(c.held_out_error) for c in found])
    floor = np.array([c.told(c.noise_floor) for c in found])
    tried = np.array([found[0].told(r.held_out_error) for r in refused])
    ends = limits(train, held_out, floor, tried, zero=True)
    right = max(len(stages) - 0.5, 0.6)
    plot = Plot(
        "Error of each step against the noise floor", (-0.5, right), ends, "",
        f"error [{found[0].told_in}]", 760, 320, names=[s.label for s in stages],
    )  # fmt: skip
    for k, level in enumerate(floor.tolist()):
        plot.box((k - 0.5, k + 0.5), (0.0, level), "floor", f"noise floor {level:.4g}", 0.25)
        plot.line(np.array([k - 0.5, k + 0.5]), np.full(2, level), "floor")
    plot.text(-0.46, float(floor[0]), "noise floor", up=6)
    plot.line(at, train, "train", width=2, dash="6 5", marks=True, name="training")
    plot.line(at, held_out, "held", width=3, marks=True, name="held out")
    for k, error in enumerate(held_out.tolist()):
        plot.text(k + 0.06, error, f"{error:.3g}", "held", up=9)
    for place, entry in _positions(refused):
        error = found[0].told(entry.held_out_error)
        plot.mark(place, error, "refused", f"{entry.label} refused: {error:.4g}", hollow=True)
    return plot.drawn()


def _positions(refused: Sequence[Refused]) -> list[tuple[float, Refused]]:
    """Horizontal positions of refused effects, right of the step at which each was tried."""
    seen: dict[int, int] = {}
    placed = []
    for entry in refused:
        seen[entry.after] = seen.get(entry.after, 0) + 1
        placed.append((entry.after + min(0.12 + 0.09 * seen[entry.after], 0.45), entry))
    return placed


def stretch(first: Signals, last: Signals, channel: int) -> slice:
    """The section in which the error fell most, which shows the effects best."""
    measured = np.nan_to_num(first.measured[:, channel] - np.nanmean(first.measured[:, channel]))
    crossings = max(int(np.sum(np.diff(np.sign(measured)) != 0)), 1)
    width = int(np.clip(len(measured) * CROSSINGS / crossings, 60, len(measured)))
    gain = first.residual[:, channel] ** 2 - last.residual[:, channel] ** 2
    if first is last:
        gain = first.residual[:, channel] ** 2
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(gain))])
    begin = int(np.argmax(total[width:] - total[:-width]))
    return slice(begin, begin + width)


def signal_chart(
    found: Signals, channel: int, part: slice, axis: str, ends: tuple[float, float]
) -> str:
    """Measured and modelled output over a section."""
    time = found.time[part]
    plot = Plot(
        "measured and modelled", (float(time[0]), float(time[-1])), ends, "",
        axis, 760, 190,
    )  # fmt: skip
    plot.line(time, found.measured[part, channel], "measured", width=3.2, name="measured")
    plot.line(time, found.modelled[part, channel], "model", width=1.5, name="modelled")
    return plot.drawn()


def residual_chart(
    found: Signals, channel: int, part: slice, unit: str, ends: tuple[float, float]
) -> str:
    """Residual over the same section, on its own axis."""
    time = found.time[part]
    plot = Plot(
        "residual", (float(time[0]), float(time[-1])), ends, "time [s]", f"residual [{unit}]",
        760, 130,
    )  # fmt: skip
    residual = found.residual[part, channel]
    plot.line(time[[0, -1]], np.zeros(2), "soft", width=1)
    plot.line(time, residual, "rest", width=1.3, name="residual")
    return plot.drawn()


def surface_chart(stage: Stage, channel: int, most: float, unit: str) -> str | None:
    """Mean residual over position × velocity; None if the model has no motion."""
    grid = residual_over_motion(stage, channel)
    if grid is None:
        return None
    x, v, means, counts = grid
    words = motion_units(stage)
    plot = Plot(
        "mean residual by position and velocity", (x[0], x[-1]), (v[0], v[-1]),
        f"position [{words[0]}]", f"velocity [{words[1]}]", 372, 290,
    )  # fmt: skip
    for i, j in np.argwhere(counts > 0):
        mean = float(means[i, j])
        told = f"{mean:.3g} {unit} over {int(counts[i, j])} samples"
        strength = min(abs(mean) / most, 1.0)
        colour = "plus" if mean > 0 else "minus"
        plot.box((x[i], x[i + 1]), (v[j], v[j + 1]), colour, told, 0.06 + 0.94 * strength)
    return plot.drawn()


def motion_units(stage: Stage) -> tuple[str, str]:
    """Units of the pair returned by `locate.motion`: of two inputs, otherwise of two states."""
    model = stage.bench.study.model
    if "position" in model.inputs and "velocity" in model.inputs:
        return model.inputs["position"].unit, model.inputs["velocity"].unit
    return model.states["x"].unit, model.states["v"].unit


def surface_peak(stage: Stage, channel: int) -> float:
    """Largest mean residual of a cell with enough samples, drawn in full colour."""
    grid = residual_over_motion(stage, channel)
    if grid is None:
        return 1.0
    _, _, means, counts = grid
    return max(float(np.quantile(np.abs(means[counts > 0]), 0.97)), 1e-300)


def residual_over_motion(
    stage: Stage, channel: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Mean training residual by position and velocity; None if the model has no motion.

    Returns edges of the position and of the velocity, shape (cells + 1,), mean residual and number
    of samples of each cell, shape (cells, cells).
    """
    residual = stage.bench.base.train.residuals[..., channel].ravel()
    moved = motion(stage.bench, sample_numbers(stage.bench.data.train, len(residual)))
    if moved is None:
        return None
    x, v = moved
    good = np.isfinite(residual) & np.isfinite(x) & np.isfinite(v)
    if good.sum() < CELLS or np.ptp(x[good]) == 0 or np.ptp(v[good]) == 0:
        return None
    counts, edges_x, edges_v = np.histogram2d(x[good], v[good], CELLS)
    sums, _, _ = np.histogram2d(x[good], v[good], (edges_x, edges_v), weights=residual[good])
    return edges_x, edges_v, sums / np.maximum(counts, 1), counts


def bars_chart(
    before: Sequence[Region], now: Sequence[Region], floor: float, words: str, unit: str
) -> str:
    """Residual by region, in pairs: the model alone and the current model."""
    names = [region.name for region in before]
    by_name = {region.name: region for region in now}
    values = np.array([r.rms for r in (*before, *now)])
    wide = len(names) > NARROW
    plot = Plot(
        f"residual by {words}", (-0.6, len(names) - 0.4), limits(values, zero=True),
        "" if not wide else words, f"rms [{unit}]", 760 if wide else 372, 230,
        names=[_short(name) for name in names],
    )  # fmt: skip
    for k, region in enumerate(before):
        told = f"{region.name}: {region.rms:.3g} {unit} with the model alone"
        plot.box((k - 0.36, k - 0.02), (0, region.rms), "before", told)
        if region.name in by_name:
            rms = by_name[region.name].rms
            plot.box((k + 0.02, k + 0.36), (0, rms), "held", f"{region.name}: {rms:.3g} {unit} now")
    plot.line(
        np.array([-0.6, len(names) - 0.4]),
        np.full(2, floor),
        "soft",
        dash="4 4",
        name="noise floor",
    )
    return plot.drawn()


def _short(name: str) -> str:
    return name.partition(" to ")[0].replace("|x - mean| ", "")


def spectrum_chart(first: Stage, last: Stage, channel: int, unit: str) -> str:
    """Spectral density of the training residual: the model alone and the current model."""
    curves = [_density(stage, channel) for stage in (first, last)]
    rate = curves[0][0]
    ends = limits(*[np.log10(np.maximum(d, 1e-300)) for _, d in curves])
    plot = Plot(
        "spectrum of the residual", (float(rate[0]), float(rate[-1])),
        (10 ** ends[0], 10 ** ends[1]), "frequency [Hz]", f"[{unit}²/Hz]", 760, 250,
        x_log=True, y_log=True,
    )  # fmt: skip
    plot.line(*curves[0], "before", width=2, name="model alone")
    if last is not first:
        plot.line(*curves[1], "held", width=2, name="current model")
    return plot.drawn()


def _density(stage: Stage, channel: int) -> tuple[FloatArray, FloatArray]:
    recording = stage.bench.data.train
    factor = recording.thinning.factor if recording.thinning else 1
    residual = np.nan_to_num(stage.bench.base.train.residuals[..., channel].ravel())
    length = min(len(residual), max(256, len(residual) // 6))
    rate, density = welch(residual, 1 / (recording.dt * factor), nperseg=length)
    return rate[1:], np.maximum(density[1:], 1e-300)
