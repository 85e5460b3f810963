"""Running energies over a short window, exact as in `window.py`: a two-stack queue."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.signals import fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

HEAD, FILL, FRONT_LEFT = 0, 1, 2
SIGNALS = 5
"""Signals of a sample. A constant, so that loops over them are written out."""


class Energies(NamedTuple):
    """Squares of several signals: ring (N, SIGNALS), suffix sums (N + 1, SIGNALS), running sum
    (SIGNALS,), places.
    """

    rows: FloatArray
    front: FloatArray
    back: FloatArray
    place: NDArray[np.int64]


def new_energies(length: int) -> Energies:
    """An empty window over `length` samples."""
    return Energies(
        np.zeros((length, SIGNALS)),
        np.zeros((length + 1, SIGNALS)),
        np.zeros(SIGNALS),
        np.zeros(3, np.int64),
    )


@part()
def restart_energies(energies: Energies) -> None:
    """Remove all samples."""
    place = energies.place
    place[HEAD] = place[FILL] = place[FRONT_LEFT] = 0
    fill(energies.front[0], 0.0)
    fill(energies.back, 0.0)


@part(inline="always")
def add(energies: Energies, signals: FloatArray) -> None:
    """Add the squares of one sample's signals and remove the oldest."""
    rows, front, back, place = energies
    length, head = rows.shape[0], place[HEAD]
    if place[FILL] == length:
        if place[FRONT_LEFT] == 0:
            for n in range(length):
                at = head - 1 - n
                if at < 0:
                    at += length
                for i in range(SIGNALS):
                    front[n + 1, i] = front[n, i] + rows[at, i]
            fill(back, 0.0)
            place[FRONT_LEFT] = length
        place[FRONT_LEFT] -= 1
    else:
        place[FILL] += 1
    for i in range(SIGNALS):
        rows[head, i] = signals[i] * signals[i]
        back[i] += rows[head, i]
    place[HEAD] = head + 1 if head + 1 < length else 0


@part(inline="always")
def energy(energies: Energies, signal: int) -> float:
    """Sum of squares of one signal over the window."""
    return energies.front[energies.place[FRONT_LEFT], signal] + energies.back[signal]


@part(inline="always")
def recent_energy(energies: Energies, signal: int, count: int) -> float:
    """Sum of squares of the newest `count` samples."""
    length, at = energies.rows.shape[0], energies.place[HEAD]
    total = 0.0
    for _ in range(min(count, energies.place[FILL])):
        at = at - 1 if at > 0 else length - 1
        total += energies.rows[at, signal]
    return total
