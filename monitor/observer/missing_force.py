"""The residual of the observer: measured output minus the prediction of equations and remainder.

    e  = H[ y - ŷ - w·φ(z) ],   φ(z) = (z_i, z_i·z_j),   z = (motion, hidden states), scaled
    g1 = H[ŷ with one newton of dry friction - ŷ],   g2 = the same for viscous friction
    d  = H[ŷ + w·φ(z) with weaker inputs - ŷ - w·φ(z)]
    s  = H[ŷ + w·φ(z) with inputs late by one sample - ŷ - w·φ(z)]
    sh = H[ŷ + w·φ(z) with inputs that are held, and late by one sample - ŷ - w·φ(z)]
    l  = H[ŷ + w·φ(z) with the inputs' edges between samples - ŷ - w·φ(z)]

In an integrating plant, small errors of flows accumulate to slow errors of forces. All signals are
therefore judged above a corner frequency: H is a second-order Butterworth high-pass.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
import scipy

from monitor.model import RemainderSection
from monitor.observer.lagged_motion import EMPTY, FIRST
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

COLUMNS = (
    "residual", "dry", "viscous", "predicted", "disagreement", "measured", "weak", "late",
    "held_late", "moved",
)  # fmt: skip
(
    E, DRY_UNIT, VISCOUS_UNIT, PREDICTED, DISAGREE, MEASURED, WEAK, LATE_UNIT, HELD_LATE, MOVED,
    UNSURE_INPUT, DRY_BARE, JITTERS, JUDGED,
) = range(14)  # fmt: skip
"""Judged columns: those above, high-passed, s for what is not known of the inputs' instants, g1
without the high-pass, and whether edges jitter, so that the residual shows their instants; and
their number.
"""
WEAKER, LATER = 0.05, 0.5
"""Loss of the inputs of which the response is taken, and their lateness [samples]."""


class Polynomial(NamedTuple):
    """The remainder as arrays."""

    centre: FloatArray
    scale: FloatArray
    weights: FloatArray


def polynomial(section: RemainderSection) -> Polynomial:
    """Convert the remainder of a model file to arrays."""
    return Polynomial(*map(np.array, (section.centre, section.scale, section.weights)))


def terms(signals: FloatArray, centre: FloatArray, scale: FloatArray) -> FloatArray:
    """φ of signals, shape (n, signals), as columns, shape (n, terms)."""
    z = (signals - centre) / scale
    products = [z[:, i] * z[:, j] for i in range(z.shape[1]) for j in range(i, z.shape[1])]
    return np.column_stack([z, *products])


def levels(motion: FloatArray, predicted: FloatArray, known: RemainderSection) -> FloatArray:
    """Levels on which the healthy variance depends, shape (n, 1 + 2·motions).

    Args:
        motion: shape (n, motions).
        predicted: the high-passed prediction, shape (n,).
        known: the remainder, whose first centres and scales are those of the motion.
    """
    count = motion.shape[1]
    z = (motion - np.array(known.centre[:count])) / np.array(known.scale[:count])
    return np.ascontiguousarray(np.column_stack([predicted**2, z**2, z**4]))


def high_pass(corner: float, rate: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of H."""
    b, a = scipy.signal.butter(2, 2.0 * corner / rate, "high")
    return np.asarray(b), np.asarray(a)


class HighPassed:
    """Carries the high-passes of all columns from block to block."""

    def __init__(self, corner: float, rate: float, remainder: RemainderSection) -> None:
        self._b, self._a = high_pass(corner, rate)
        self._state = np.zeros((len(COLUMNS), 2))
        self._remainder = polynomial(remainder)

    def update(
        self,
        columns: FloatArray,
        z: FloatArray,
        changed: FloatArray,
        state: np.ndarray,
    ) -> FloatArray:
        """High-passed columns, shape (n, 10), from raw columns and the remainder's signals.

        Args:
            columns: raw.
            z: signals of the remainder, shape (n, signals).
            changed: the same with inputs that are weaker, late, held and late, and with edges
                between samples, shape (4, n, signals).
            state: of each row.
        """
        out = np.zeros_like(columns)
        _advance(columns, z, changed, state, self._remainder, self._b, self._a, self._state, out)
        return out


@kernel(allocates=True)
def _advance(  # noqa: PLR0917 -- a kernel
    columns: FloatArray,
    z: FloatArray,
    changed: FloatArray,
    state: np.ndarray,
    known: Polynomial,
    b: FloatArray,
    a: FloatArray,
    kept: FloatArray,
    out: FloatArray,
) -> None:
    scaled = np.zeros(z.shape[1])
    for k in range(state.size):
        if state[k] == EMPTY:
            continue
        if state[k] == FIRST:
            at_rest(columns[k], kept, b)
        remainder = _remainder(z[k], known, scaled)
        for c in range(columns.shape[1]):
            value = columns[k, c]
            if c == E:
                value -= remainder
            elif c >= WEAK:
                value += _remainder(changed[c - WEAK, k], known, scaled) - remainder
            if c in (LATE_UNIT, HELD_LATE):
                value /= LATER
            out[k, c] = filter_sample(b, a, kept[c], value)


@part()
def _remainder(z: FloatArray, known: Polynomial, scaled: FloatArray) -> float:
    """w·φ(z)."""
    count = z.size
    scale_signals(z, known.centre, known.scale, scaled)
    total, place = 0.0, count
    for i in range(count):
        total += known.weights[i] * scaled[i]
        for j in range(i, count):
            total += known.weights[place] * scaled[i] * scaled[j]
            place += 1
    return total


@part()
def scale_signals(z: FloatArray, centre: FloatArray, scale: FloatArray, scaled: FloatArray) -> None:
    """Fill `scaled` with the arguments of the remainder."""
    for i in range(z.size):
        scaled[i] = (z[i] - centre[i]) / scale[i]


@part()
def at_rest(row: FloatArray, kept: FloatArray, b: FloatArray) -> None:
    """Steady state of a high-pass for a constant row, in transposed direct form II."""
    for c in range(kept.shape[0]):
        kept[c, 0] = -b[0] * row[c]
        kept[c, 1] = b[2] * row[c]
