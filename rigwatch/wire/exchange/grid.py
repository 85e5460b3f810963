"""Puts jittered samples onto a uniform grid, and marks points without data nearby.

t_k = t_0 + k / rate        linear interpolation between the neighbours
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ImportDataError

JITTER = 0.1
"""Deviation from a uniform grid, in sample periods, up to which time stamps count as uniform."""
RATE_TOLERANCE = 0.02
"""Allowed relative difference between a given rate and that of the time stamps."""
LATEST = 9e9
"""Largest time whose nanoseconds fit into 64 bits [s]."""
MOST_POINTS, MOST_PER_SAMPLE = 4_000_000, 50
"""Largest number of points of any grid, plus the number per sample."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Uniform times for a recording.

    Attributes:
        rate_hz: sample rate [Hz].
        times: shape (n,) [s].
        jittered: the recording's own time stamps are not uniform, its values must be interpolated.
        in_hole: shape (n,), points without a sample of the recording nearby.
        own: shape (n,), points with a sample of their own, of a recording that is uniform but for
            missing samples.
        steps_s: shortest and longest step of the time stamps [s].
    """

    rate_hz: float
    times: FloatArray
    jittered: bool
    in_hole: NDArray[np.bool_]
    own: NDArray[np.bool_]
    steps_s: tuple[float, float]

    @property
    def averages_held(self) -> bool:
        """Whether a held channel is its mean until the next point: no point has its own sample."""
        return not self.own.any()


def fit_grid(times: FloatArray, rate: float | None, max_hole: float) -> Grid:
    """The uniform grid of a recording's time stamps.

    Args:
        times: shape (n,), increasing [s].
        rate: nominal rate [Hz], None to take the median step.
        max_hole: longest step between samples that is bridged [sample periods].

    Raises:
        ImportDataError: the rate is not that of the time stamps, or they jump too far.
    """
    if len(times) and max(abs(times[0]), abs(times[-1])) > LATEST:
        raise ImportDataError(f"time: found {times[-1]:.6g} s, expected at most {LATEST:g} s")
    period = float(np.median(np.diff(times))) if len(times) > 1 else 1.0 / (rate or 1.0)
    if rate is not None and abs(period * rate - 1) > RATE_TOLERANCE:
        found = f"found {1 / period:.6g} Hz in the time stamps, expected {rate:.6g} Hz"
        raise ImportDataError(f"rate: {found} (is the unit of the time right?)")
    span, steps = (
        float(times[-1] - times[0]),
        np.diff(times) if len(times) > 1 else np.array([period]),
    )
    extremes = float(steps.min()), float(steps.max())
    if _is_uniform(times, period):
        rate_hz = rate or _rounded((len(times) - 1) / span if span else 1 / period)
        return whole(rate_hz, times, extremes)
    rate_hz = rate or _rounded(1 / _mean_step(steps, period))
    most = MOST_POINTS + MOST_PER_SAMPLE * len(times)
    if span * rate_hz > most:
        raise ImportDataError(_too_many(times, rate_hz))
    count = int(np.floor(span * rate_hz * (1 + 1e-12))) + 1
    grid = times[0] + np.arange(count) / rate_hz
    holes = _holes(times, grid, max_hole / rate_hz)
    return Grid(rate_hz, grid, True, holes, _own(times, grid, rate_hz), extremes)


def mean_while_held(grid: Grid, times: FloatArray, values: FloatArray) -> FloatArray:
    """The mean of a held signal from each point of the grid to the next, shape of `grid.times`.

    Args:
        grid: the points.
        times: at which the signal takes its values, shape (n,), increasing [s].
        values: shape (n,); each holds until the next time.
    """
    period = 1 / grid.rate_hz
    begin, end = grid.times, grid.times + period
    first = np.maximum(np.searchsorted(times, begin, side="right") - 1, 0)
    last = np.maximum(np.searchsorted(times, end, side="left") - 1, first)
    until = np.append(times, max(float(times[-1]), float(end[-1])) + period)
    areas = np.concatenate([[0.0], np.cumsum(values * np.diff(until))])
    mean = (np.interp(end, until, areas) - np.interp(begin, until, areas)) / period
    # A sum over the whole recording has rounding errors; a value that stays is that value.
    stays = (values[first] == values[last]) & (last - first <= 1)
    return np.asarray(np.where(stays, values[first], mean))


def whole(rate_hz: float, times: FloatArray, steps_s: tuple[float, float]) -> Grid:
    """The grid of a recording without jitter and holes."""
    n = len(times)
    return Grid(rate_hz, times, False, np.zeros(n, bool), np.ones(n, bool), steps_s)


def _own(times: FloatArray, grid: FloatArray, rate_hz: float) -> NDArray[np.bool_]:
    """Points with a sample of their own; none of a recording whose time stamps are jittered."""
    own = np.zeros(len(grid), np.bool_)
    at = (times - times[0]) * rate_hz
    nearest = np.rint(at).astype(np.int64)
    if np.abs(at - nearest).max() <= JITTER:
        own[nearest[nearest < len(grid)]] = True
    return own


def _too_many(times: FloatArray, rate_hz: float) -> str:
    at = int(np.argmax(np.diff(times)))
    jump = f"a jump from {times[at]:.6g} s to {times[at + 1]:.6g} s"
    points = f"{(times[-1] - times[0]) * rate_hz:.3g} points at {rate_hz:.6g} Hz"
    return f"time: found {jump}, which needs {points}; expected one recording without it"


def _is_uniform(times: FloatArray, period: float) -> bool:
    """Whether all time stamps are close to the straight line through the first and the last."""
    steps = len(times) - 1
    span = float(times[-1] - times[0])
    line = times[0] + np.arange(steps + 1) * (span / max(1, steps))
    mean_is_median = abs(span - steps * period) <= RATE_TOLERANCE * span
    return bool(np.abs(times - line).max() <= JITTER * period and mean_is_median)


def _mean_step(steps: FloatArray, median: float) -> float:
    """Mean of the steps without holes [s]: the median of rounded time stamps is rounded too.

    Where one half of the steps is much longer than the other, none is near their median: the
    shorter ones count, so that no sample is lost.
    """
    usual = steps[np.abs(steps - median) < 0.5 * median]
    return float(usual.mean() if usual.size else steps[steps < median].mean())


def _rounded(rate: float) -> float:
    """The rate to six digits: more would be rounding errors of the time stamps."""
    return float(f"{rate:.6g}")


def _holes(times: FloatArray, grid: FloatArray, longest: float) -> NDArray[np.bool_]:
    """Points of the grid that lie inside a step of `times` longer than `longest` [s]."""
    after = np.clip(np.searchsorted(times, grid, side="left"), 1, len(times) - 1)
    before = after - 1
    on_sample = (np.abs(times[after] - grid) < 1e-9) | (np.abs(times[before] - grid) < 1e-9)
    return (times[after] - times[before] > longest) & ~on_sample
