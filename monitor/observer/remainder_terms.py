"""The terms of the remainder, high-passed as the residual is, and how sure their weights are.

    φ(z) of motion and hidden states ─▶ H[φ]          weights ~ N(w, σ²·(RᵀR)⁻¹)

Friction changes the motion, and with it what the equations mispredict. How, the healthy recordings
tell in part: of a periodic motion, only sums of terms that it distinguishes. What the weights of
all others may be is as large as what the equations leave of the healthy rig. σ² is the mean square
of what equations and remainder leave of it.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from collections.abc import Collection

import numpy as np

from monitor.model import RemainderSection
from monitor.observer.lagged_motion import EMPTY, FIRST
from monitor.observer.missing_force import at_rest, high_pass, scale_signals
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel, part

REPEATS = 400.0
"""Healthy samples that count as one: their motions repeat, and what the equations leave of them is
not random."""
SIZE = 4.0
"""Size that a weight may have which the healthy recordings do not determine, in what the equations
leave of them [rms]: the terms have a standard deviation of about one."""
DIGITS = 6
"""Significant digits that are stored."""


def counting_terms(signals: int, without: Collection[int]) -> BoolArray:
    """Whether each term of so many signals contains none of those left out, shape (terms,)."""
    counts = ~np.isin(np.arange(signals), list(without))
    return np.concatenate([counts, np.outer(counts, counts)[np.triu_indices(signals)]])


def information_of(phi: FloatArray, residual: FloatArray, left: FloatArray) -> tuple[float, ...]:
    """The upper triangle of R, row by row.

    Args:
        phi: high-passed terms that count of the healthy recordings, shape (n, terms).
        residual: what the equations leave of them, high-passed, shape (n,).
        left: the same without the remainder, shape (n,).
    """
    size = max(SIZE**2 * float(np.mean(residual**2)), 1e-24)
    variance = max(float(np.mean(left**2)), 1e-9 * size)
    found = phi.T @ phi / REPEATS + np.eye(phi.shape[1]) * variance / size
    root = np.linalg.cholesky(found).T[np.triu_indices(len(found))]
    return tuple(float(f"{value:.{DIGITS}g}") for value in root)


def information_matrix(remainder: RemainderSection, without: Collection[int]) -> FloatArray:
    """RᵀR of the terms that count, shape (terms, terms); (0, 0) if it is not known.

    Raises:
        ModelError: the section has another number of values.
    """
    count = int(np.count_nonzero(counting_terms(len(remainder.centre), without)))
    stored = remainder.information
    if not stored:
        return np.zeros((0, 0))
    if len(stored) != count * (count + 1) // 2:
        raise ModelError(
            f"remainder.information: found {len(stored)} values,"
            f" expected {count * (count + 1) // 2} for {count} terms, or none"
        )
    root = np.zeros((count, count))
    root[np.triu_indices(count)] = stored
    return np.asarray(root.T @ root)


class RemainderTerms:
    """The high-passed terms that count, from block to block.

    Args:
        remainder: of the model file.
        without: indices of signals on which it does not depend.
        corner: of the high-pass [Hz].
        rate: sample rate [Hz].
    """

    def __init__(
        self, remainder: RemainderSection, without: Collection[int], corner: float, rate: float
    ) -> None:
        self._counts = counting_terms(len(remainder.centre), without)
        self._centre, self._scale = np.array(remainder.centre), np.array(remainder.scale)
        self._b, self._a = high_pass(corner, rate)
        self._state = np.zeros((int(np.count_nonzero(self._counts)), 2))

    def update(self, z: FloatArray, state: np.ndarray) -> FloatArray:
        """The terms of the next samples, shape (n, terms).

        Args:
            z: signals of the remainder, shape (n, signals).
            state: of each sample, see `lagged_motion.FixedLag`.
        """
        out = np.zeros((len(z), len(self._state)))
        _advance(
            z, state, self._centre, self._scale, self._counts, self._b, self._a, self._state, out
        )
        return out


@kernel(allocates=True)
def _advance(  # noqa: PLR0917 -- a kernel
    z: FloatArray,
    state: np.ndarray,
    centre: FloatArray,
    scale: FloatArray,
    counts: BoolArray,
    b: FloatArray,
    a: FloatArray,
    kept: FloatArray,
    out: FloatArray,
) -> None:
    scaled = np.zeros(z.shape[1])
    for k in range(state.size):
        if state[k] == EMPTY:
            continue
        scale_signals(z[k], centre, scale, scaled)
        _fill_terms(scaled, counts, out[k])
        if state[k] == FIRST:
            at_rest(out[k], kept, b)
        for c in range(out.shape[1]):
            out[k, c] = filter_sample(b, a, kept[c], out[k, c])


@part()
def _fill_terms(scaled: FloatArray, counts: BoolArray, row: FloatArray) -> None:
    """The terms that count, in the order of `missing_force.terms`."""
    term = 0
    for i in range(scaled.size):
        if counts[i]:
            row[term] = scaled[i]
            term += 1
    place = scaled.size
    for i in range(scaled.size):
        for j in range(i, scaled.size):
            if counts[place]:
                row[term] = scaled[i] * scaled[j]
                term += 1
            place += 1
