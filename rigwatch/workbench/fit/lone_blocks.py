"""Divides blocks of a residual without which a parameter is not determined.

A jackknife leaves out one block at a time. A stop that is reached once shows in one block only:
without it the others say nothing of the stop, and their scatter is none of its. How well the block
itself determines it, its parts tell, if each is longer than its error is correlated; a parameter
that shows in a single part has no interval.
"""

import numpy as np

from rigwatch.physics.engine.score import autocorrelation, correlation_time
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray

TOLD = 1e-12
"""Information on a direction of the parameters, over the largest, below which there is none."""
LOST = 1e-6
"""Share of a parameter in such directions from which it is not determined."""
MEMORIES, MOST = 2.0, 8
"""Length of a part over the correlation time, and number of parts at most."""


def lost(information: FloatArray) -> BoolArray:
    """Which parameters information of shape (…, m, m) does not determine, shape (…, m)."""
    kept = information @ np.linalg.pinv(information, rcond=TOLD)
    return np.asarray(1.0 - np.diagonal(kept, axis1=-2, axis2=-1) > LOST)


def with_lone_blocks_divided(
    slopes: FloatArray, error: FloatArray, number: IntArray, order: IntArray
) -> list[IntArray]:
    """The rows of each block; those that alone determine a parameter are divided.

    Args:
        slopes: of the error by the parameters, each of length 1, shape (rows, m).
        error: shape (rows,).
        number: of the block of each row, shape (rows,).
        order: place of each row's sample in time or in the excitation, shape (rows,).
    """
    blocks = [np.flatnonzero(number == block) for block in range(int(number.max()) + 1)]
    whole = slopes.T @ slopes
    own = np.array([slopes[rows].T @ slopes[rows] for rows in blocks])
    found = list[IntArray]()
    for rows, alone in zip(blocks, lost(whole - own) & ~lost(whole), strict=True):
        if alone.any():
            found += _divided(slopes[rows][:, alone], error[rows], rows, order[rows])
        else:
            found.append(rows)
    return found


def _divided(
    slopes: FloatArray, error: FloatArray, rows: IntArray, order: IntArray
) -> list[IntArray]:
    """The rows of one block in parts that tell equally much of what only this block shows."""
    places, sample = np.unique(order, return_inverse=True)
    told = np.bincount(sample, np.sum(slopes**2, axis=1))
    shares = np.empty((1, len(places), slopes.shape[1]))
    for index, each in enumerate(slopes.T):
        shares[0, :, index] = np.bincount(sample, each * error)
    memory = max(correlation_time(each) for each in autocorrelation(shares, len(places)).T)
    count = int(np.clip(np.count_nonzero(told) / (MEMORIES * memory), 1, MOST))
    before = np.cumsum(told) - told
    part = np.minimum((before / told.sum() * count).astype(np.int64), count - 1)[sample]
    parts = (rows[part == each] for each in range(count))
    return [each for each in parts if len(each)]
