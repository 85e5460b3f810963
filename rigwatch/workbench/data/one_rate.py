"""Recordings of different rates on one: low-passed where they are thinned, then interpolated.

Loggers that are not clocked together differ by parts of a percent. Such recordings are put on the
slowest rate among them; others only where the study says `rate`, as that changes what is seen.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data.columns import Columns, bridged

SAME = 1e-3
"""Difference of rates, over the rate, from which recordings are resampled."""
ALIKE = 0.05
"""Difference up to which they are without being asked to."""
THINNED = 1.1
"""Ratio of rates from which signals are low-passed first."""
PASSED = 0.4
"""Corner of the low-pass over the new rate; a zero-phase Butterworth of order 8."""


def on_one_rate(
    tables: Sequence[Columns],
    names: Sequence[str],
    rate: float | None,
    kept: frozenset[str] = frozenset(),
) -> tuple[list[Columns], list[str]]:
    """The recordings on one rate, and what was done in words.

    Args:
        tables: the recordings.
        names: of their sessions.
        rate: that the study asks for [Hz], None to take the slowest where they are alike.
        kept: channels that are kept from sample to sample and must not be rounded off.

    Raises:
        ModelError: rates differ by more than loggers do, or the study asks for a faster one.
    """
    found = [1 / table.dt for table in tables]
    target = rate or min(found)
    for name, own in zip(names, found, strict=True):
        if rate is None and abs(own / found[0] - 1) > ALIKE:
            raise ModelError(
                f"{name}: found {own:g} Hz, expected {found[0]:g} Hz as in {names[0]};"
                f" `rate = {min(found):g}` in the study puts all recordings on one rate"
            )
        if rate is not None and own < rate * (1 - SAME):
            raise ModelError(
                f"rate: found {rate:g} Hz, expected at most {own:g} Hz, the rate of {name}"
            )
    made, remarks = list(tables), list[str]()
    if max(found) <= target * (1 + SAME) and max(found) <= min(found) * (1 + SAME):
        return made, remarks
    for index, own in enumerate(found):
        if own != target:
            made[index] = resampled(tables[index], target, kept)
            remarks.append(f"{names[index]}: {own:.6g} Hz, resampled to {target:.6g} Hz")
    return made, remarks


def resampled(table: Columns, rate: float, kept: frozenset[str] = frozenset()) -> Columns:
    """The channels at a rate [Hz] that is no faster; NaN beside what is missing."""
    count = int(np.floor((len(table) - 1) * table.dt * rate + 1e-9)) + 1
    at = np.arange(count) / (rate * table.dt)
    values = {
        name: _held(signal, at) if name in kept else _smooth(signal, at, 1 / (rate * table.dt))
        for name, signal in table.values.items()
    }
    return replace(table, dt=1 / rate, values=values)


def _held(signal: FloatArray, at: FloatArray) -> FloatArray:
    """The last sample before each place."""
    return signal[np.minimum(np.floor(at + 1e-9).astype(np.int64), len(signal) - 1)]


def _smooth(signal: FloatArray, at: FloatArray, ratio: float) -> FloatArray:
    """Low-passed where `ratio` of the old rate over the new one asks for it, and interpolated."""
    good = np.isfinite(signal)
    if not good.any():
        return np.full(len(at), np.nan)
    whole = bridged(signal)
    if ratio > THINNED and len(whole) > 60:
        whole = sosfiltfilt(butter(8, 2 * PASSED / ratio, output="sos"), whole)
    found = CubicSpline(np.arange(len(whole)), whole)(at)
    missing = np.interp(at, np.arange(len(signal)), ~good) > 0
    return np.where(missing, np.nan, found)
