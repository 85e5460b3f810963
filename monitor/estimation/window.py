"""Least squares over a sliding window, exact after any number of samples (docs/theory.md 1.4).

    θ̂ = ( Σ g·gᵀ )⁻¹ · Σ g·y   over the last N samples                                     (5.39)

The sums over the window are never down-dated. They are organised as a two-stack queue: `back` is
the running sum of the newer samples, `front[i]` the sum of the older ones from place i up to where
`back` begins. A sample is removed by moving to the next `front`; when none is left, `front` is
recomputed from the stored samples. A spike therefore leaves no trace, to the last bit, at constant
average cost per sample.

Rows are (g1, g2, y); the sums are those of all products of two entries, upper triangle row by row.
A row that must not count (an invalid sample) is pushed as zeros, so the window keeps its length in
time.
"""

from typing import NamedTuple

import numpy as np

from monitor.signals import fill
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.kernel import kernel, part

HEAD, FILL, FRONT_LEFT, LENGTH = 0, 1, 2, 3
WIDTH = 3
"""Entries of a row: two regressors and y. A constant, so that loops over them are written out."""
SUMS = WIDTH * (WIDTH + 1) // 2


class Window(NamedTuple):
    """State of one sliding window.

    Args:
        rows: ring of the stored rows, shape (N, WIDTH).
        front: sums of the older samples, shape (N + 1, SUMS).
        back: sum of the newer samples, shape (SUMS,).
        place: head of the ring, samples in it, older samples left in `front`, N itself.
    """

    rows: FloatArray
    front: FloatArray
    back: FloatArray
    place: IntArray


def new_window(length: int) -> Window:
    """An empty window over `length` samples."""
    return Window(
        np.zeros((length, WIDTH)),
        np.zeros((length + 1, SUMS)),
        np.zeros(SUMS),
        np.array([0, 0, 0, length], np.int64),
    )


@part()
def restart_window(window: Window, length: int) -> None:
    """Remove all samples; the window then spans `length` samples, at most its capacity."""
    window.place[HEAD] = 0
    window.place[FILL] = 0
    window.place[FRONT_LEFT] = 0
    window.place[LENGTH] = length
    fill(window.front[0], 0.0)
    fill(window.back, 0.0)


@part(inline="always")
def push(window: Window, row: FloatArray) -> None:
    """Add one row, and remove the oldest if the window is full."""
    rows, _, back, place = window
    length, head = place[LENGTH], place[HEAD]
    if place[FILL] == length:
        if place[FRONT_LEFT] == 0:
            _refill(window)
        place[FRONT_LEFT] -= 1
    else:
        place[FILL] += 1
    k = 0
    for i in range(WIDTH):
        rows[head, i] = row[i]
        for j in range(i, WIDTH):
            back[k] += row[i] * row[j]
            k += 1
    place[HEAD] = head + 1 if head + 1 < length else 0


@part()
def _refill(window: Window) -> None:
    """Move everything from `back` to `front`: suffix sums from the newest sample to the oldest."""
    rows, front, back, place = window
    length = place[LENGTH]
    newest = place[HEAD] - 1
    fill(front[0], 0.0)
    for n in range(length):
        at = newest - n
        if at < 0:
            at += length
        k = 0
        for i in range(WIDTH):
            for j in range(i, WIDTH):
                front[n + 1, k] = front[n, k] + rows[at, i] * rows[at, j]
                k += 1
    fill(back, 0.0)
    place[FRONT_LEFT] = length


@part(inline="always")
def sums(window: Window, out: FloatArray) -> None:
    """Sums of products over the window into `out`, shape (SUMS,)."""
    _, front, back, place = window
    for k in range(SUMS):
        out[k] = front[place[FRONT_LEFT], k] + back[k]


@part()
def solve_two(s: FloatArray) -> tuple[float, float, float]:
    """(θ1, θ2, condition number of the normal matrix scaled to unit diagonal) from six sums.

    `s` holds Σ g1², g1·g2, g1·y, g2², g2·y, y². If the matrix is singular, the condition number is
    infinite and θ is zero.
    """
    determinant = s[0] * s[3] - s[1] * s[1]
    scale = s[0] * s[3]
    if not (scale > 0.0 and determinant > 1e-15 * scale):
        return 0.0, 0.0, np.inf
    correlation = abs(s[1]) / np.sqrt(scale)
    condition = (1.0 + correlation) / (1.0 - correlation)
    theta1 = (s[3] * s[2] - s[1] * s[4]) / determinant
    theta2 = (s[0] * s[4] - s[1] * s[2]) / determinant
    return theta1, theta2, condition


@kernel(allocates=True)
def windowed_least_squares(
    window: Window, g1: FloatArray, g2: FloatArray, y: FloatArray, theta: FloatArray
) -> None:
    """Write estimates after each sample to `theta`, shape (n, 2): the thesis's plain scheme."""
    row, s = np.empty(3), np.empty(6)
    for k in range(y.size):
        row[0], row[1], row[2] = g1[k], g2[k], y[k]
        push(window, row)
        sums(window, s)
        theta[k, 0], theta[k, 1], _ = solve_two(s)
