"""Resamples recordings to one sample rate: low-pass if the rate is reduced, then interpolation.

Loggers without a common clock differ by fractions of a percent. Such recordings keep their rates:
resampled, an input that is held would change between samples. Only what needs one rate for all, as
a smoothing of the measured motion does, has them resampled to the slowest among them. Larger
differences are resampled only if the study gives `rate`, as that changes the signal content.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from rigwatch.physics.engine.fit import SAME_SPACING
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data.columns import Columns, bridged

SAME = 1e-3
"""Relative difference of rates above which recordings are resampled."""
ALIKE = 0.05
"""Relative difference up to which they are resampled without `rate`."""
THINNED = 1.1
"""Ratio of rates above which signals are low-passed first."""
MENTIONED = 3
"""Most recordings that are named one by one."""
PASSED = 0.4
"""Corner of the low-pass over the new rate; a zero-phase Butterworth of order 8."""
FLAT = 0.32
"""Highest frequency over the new rate at which low-pass and interpolation leave noise as it is: to
within a tenth of its power. Between samples, splines lose half of it at half the rate."""
TOUCHED = 1e-6
"""Share of an interval without a valid sample that is no rounding error."""
RESAMPLED = "samples are at another rate than recorded"
"""How a recording is altered that is resampled."""


def at_own_rates(tables: Sequence[Columns], names: Sequence[str]) -> list[str]:
    """Remarks on recordings that keep their rates.

    Args:
        tables: the recordings.
        names: of their sessions.

    Raises:
        ModelError: rates differ by more than clock tolerances.
    """
    rates = [1 / table.dt for table in tables]
    _check_alike(rates, names)
    slowest, fastest = min(rates), max(rates)
    if fastest <= slowest * (1 + SAME_SPACING):
        return []
    return [f"{len(rates)} recordings of {slowest:.6g} to {fastest:.6g} Hz, each at its own rate"]


def _check_alike(rates: Sequence[float], names: Sequence[str]) -> None:
    for name, own in zip(names, rates, strict=True):
        if abs(own / rates[0] - 1) > ALIKE:
            raise ModelError(
                f"{name}: found {own:g} Hz, expected {rates[0]:g} Hz as in {names[0]};"
                f" `rate = {min(rates):g}` in the study puts all recordings on one rate"
            )


def on_one_rate(
    tables: Sequence[Columns],
    names: Sequence[str],
    rate: float | None,
    kept: frozenset[str] = frozenset(),
) -> tuple[list[Columns], list[str]]:
    """The recordings at one sample rate, and remarks on resampled channels.

    Args:
        tables: the recordings.
        names: of their sessions.
        rate: requested by the study [Hz]; None to take the slowest if they are nearly equal.
        kept: channels with a zero-order hold: their mean over each new interval acts there.

    Raises:
        ModelError: rates differ by more than clock tolerances, or the study requests a faster one.
    """
    found = [1 / table.dt for table in tables]
    target = rate or min(found)
    if rate is None:
        _check_alike(found, names)
    for name, own in zip(names, found, strict=True):
        if rate is not None and own < rate * (1 - SAME):
            raise ModelError(
                f"rate: found {rate:g} Hz, expected at most {own:g} Hz, the rate of {name}"
            )
    made, remarks = list(tables), list[str]()
    if max(found) <= target * (1 + SAME) and max(found) <= min(found) * (1 + SAME):
        return made, remarks
    for index, own in enumerate(found):
        if not math.isclose(own, target):
            made[index] = resampled(tables[index], target, kept)
            remarks.append(f"{names[index]}: {own:.6g} Hz, resampled to {target:.6g} Hz")
    if len(remarks) > MENTIONED:
        span = f"{min(found):.6g} to {max(found):.6g} Hz"
        remarks = [f"{len(remarks)} recordings of {span}, resampled to {target:.6g} Hz"]
    return made, remarks


def resampled(table: Columns, rate: float, kept: frozenset[str] = frozenset()) -> Columns:
    """The channels resampled to an equal or lower rate [Hz]; NaN next to gaps."""
    count = int(np.floor((len(table) - 1) * table.dt * rate + 1e-9)) + 1
    at = np.arange(count) / (rate * table.dt)
    ratio = 1 / (rate * table.dt)
    values = {
        name: _held(signal, at, ratio) if name in kept else _smooth(signal, at, ratio)
        for name, signal in table.values.items()
    }
    altered = (*table.altered, RESAMPLED)
    passed = min(table.passed * ratio, FLAT)
    return replace(table, dt=1 / rate, values=values, altered=altered, passed=passed)


def _held(signal: FloatArray, at: FloatArray, ratio: float) -> FloatArray:
    """The mean of a held signal over the interval of `ratio` samples from each point on."""
    sums = np.concatenate([[0.0], np.cumsum(signal)])
    if not np.isfinite(sums[-1]):
        missing = ~np.isfinite(signal)
        part = _held(missing.astype(np.float64), at, ratio)
        return np.where(part > TOUCHED, np.nan, _held(np.where(missing, 0.0, signal), at, ratio))
    ends = np.minimum(at + ratio, len(signal))
    samples = np.arange(len(sums))
    whole = np.interp(ends, samples, sums) - np.interp(at, samples, sums)
    return np.asarray(whole / (ends - at), np.float64)


def _is_low_passed(ratio: float, samples: int) -> bool:
    return ratio > THINNED and samples > 60


def _smooth(signal: FloatArray, at: FloatArray, ratio: float) -> FloatArray:
    """Interpolate; low-pass first if `ratio`, the old rate over the new one, is large enough."""
    good = np.isfinite(signal)
    if not good.any():
        return np.full(len(at), np.nan)
    whole = bridged(signal)
    if _is_low_passed(ratio, len(whole)):
        whole = sosfiltfilt(butter(8, 2 * PASSED / ratio, output="sos"), whole)
    found = CubicSpline(np.arange(len(whole)), whole)(at)
    missing = np.interp(at, np.arange(len(signal)), ~good) > 0
    return np.where(missing, np.nan, found)
