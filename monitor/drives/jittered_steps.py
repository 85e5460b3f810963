"""The voltage in force where a generator steps at the instants of sampling.

A converter that updates at the DAQ's instants, a little early or late by chance, is read after an
update at one sample and before it at the next: readings repeat and skip steps in turn, though the
voltage in force until the next sample is always that after the update. Which readings are old shows
in the input alone. With time moved back by a sample where they are, all readings of a window lie on
one smooth curve, and on none otherwise. Each window that holds a reading says how much better the
curve fits if it is old; the curve gives what a moment later would have been read.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.drives.reading_ages import Ages, assumptions, misfit
from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill, fill_rows, push
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel, part

HALF = 4
"""Readings on either side of a window's middle."""
ROUGH, EDGE = 0.03, 0.6
"""Energy that no curve fits, relative to the mean square of the steps, above which a window may
hold old readings; and share of one step in the energy of all, above which it holds an edge.
"""
FITS = 0.05
"""Share of that energy that may be left with the old readings moved."""
CLEAR = 0.05
"""Sum over windows of what is gained, relative to the steps' mean squares, that tells old from new;
with less a reading is taken as the one before it.
"""
UNTOLD = 8.0
"""Readings in a row that nothing tells from new, after which the next is as most of those told."""
MEMORY, OFTEN = 64.0, 0.06
"""Memory, and share of the windows that hold old and new readings in turn, above which the steps
jitter [samples].
"""
REMEMBERED = 1024.0
"""Samples for which steps are taken to jitter after they have shown it."""


class Jittered(NamedTuple):
    """An input at the samples `half_width` before those given, both of shape (n,).

    Attributes:
        value: the voltage in force until the next sample, where the steps jitter.
        jitters: whether they do, or did in the last `REMEMBERED` samples.
        shows: whether the samples around show it.
    """

    value: FloatArray
    jitters: BoolArray
    shows: BoolArray


class JitteredSteps:
    """Follows one input, block by block.

    Args:
        half_width: lag of the results [samples].
    """

    def __init__(self, half_width: int) -> None:
        half = min(half_width, HALF)
        self._ages = assumptions(half)
        self._ring = np.zeros(half_width + half)
        self._gains = np.zeros((2, half + 1))
        self._kept = np.zeros(len(_AT))

    def update(self, signal: FloatArray, code: Codes) -> Jittered:
        """The next samples of the input, shape (n,), with states of the admission."""
        found = Jittered(np.zeros(code.size), *np.zeros((2, code.size), np.bool_))
        _advance(
            np.ascontiguousarray(signal), code, self._ages, self._ring, self._gains, self._kept,
            *found,
        )  # fmt: skip
        return found


class _At(NamedTuple):
    """Indices of the carried figures: those of the ring, of the share of windows, the last age."""

    head: int = 0
    filled: int = 1
    share: int = 2
    old: int = 3
    ago: int = 4
    untold: int = 5
    mostly: int = 6


_AT = _At()
HEAD, FILLED, SHARE, OLD, AGO, SINCE_TOLD, MOSTLY = _AT


@kernel(allocates=True)
def _advance(  # noqa: PLR0917 -- a kernel
    signal: FloatArray,
    code: Codes,
    ages: Ages,
    ring: FloatArray,
    gains: FloatArray,
    kept: FloatArray,
    value: FloatArray,
    jitters: NDArray[np.bool_],
    shows: NDArray[np.bool_],
) -> None:
    size = ages.values.shape[1]
    window = np.zeros(size)
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
            kept[AGO] = REMEMBERED
            fill_rows(gains, 0.0)
        if code[k] == DEAD:
            continue
        head = int(kept[HEAD])
        ring[head] = signal[k]
        head = (head + 1) % ring.size
        kept[HEAD] = head
        kept[FILLED] += 1
        if kept[FILLED] < ring.size:
            continue
        for i in range(size):
            window[i] = ring[(head + i) % ring.size]
        value[k] = _in_force(ages, window, gains, kept)
        shows[k] = kept[SHARE] > OFTEN
        kept[AGO] = 0.0 if shows[k] else min(kept[AGO] + 1.0, REMEMBERED)
        jitters[k] = kept[AGO] < REMEMBERED


@part()
def _in_force(ages: Ages, window: FloatArray, gains: FloatArray, kept: FloatArray) -> float:
    """The voltage in force in the middle of a window, which is the last to say its age."""
    now = window.size // 2 - 1
    steps, largest = 0.0, 0.0
    for i in range(window.size - 1):
        step = (window[i + 1] - window[i]) ** 2
        steps, largest = steps + step, max(largest, step)
    steps /= window.size - 1
    push(gains[0], 0.0)
    push(gains[1], 0.0)
    rough = misfit(ages.misfits[0], window)
    chosen = ages.old.shape[0] - 1
    in_turn = False
    if rough > ROUGH * steps and largest < EDGE * steps * (window.size - 1):
        in_turn, chosen = _weigh(ages, window, rough, gains)
    for i in range(gains.shape[1]):
        gains[1, i] += steps / gains.shape[1]
    kept[SHARE] += ((1.0 if in_turn else 0.0) - kept[SHARE]) / MEMORY
    kept[SINCE_TOLD] += 1.0
    if abs(gains[0, 0]) > CLEAR * gains[1, 0]:
        kept[OLD] = 1.0 if gains[0, 0] > 0.0 else 0.0
        kept[SINCE_TOLD] = 0.0
        kept[MOSTLY] += (kept[OLD] - kept[MOSTLY]) / MEMORY
    elif kept[SINCE_TOLD] > UNTOLD:
        kept[OLD] = 1.0 if kept[MOSTLY] > 0.5 else 0.0
    if kept[OLD] == 0.0:
        return window[now]
    total = 0.0
    for i in range(window.size):
        total += ages.values[chosen, i] * window[i]
    return total


@part(allocates=True)
def _weigh(ages: Ages, window: FloatArray, rough: float, gains: FloatArray) -> tuple[bool, int]:
    """Add what is gained if each reading from the middle on is old, where some assumption fits.

    Returns:
        Whether only one with old and new readings in turn fits, and not one that changes once, as
        where steps slide; and the best one in which the middle reading is old.
    """
    now = window.size // 2 - 1
    least = np.empty((2, window.size))
    fill_rows(least, np.inf)
    once, chosen = np.inf, ages.old.shape[0] - 1
    for tried in range(ages.old.shape[0]):
        error = misfit(ages.misfits[tried], window)
        if ages.changes[tried] <= 1:
            once = min(once, error)
        if ages.old[tried, now] == 1 and error < least[1, now]:
            chosen = tried
        for i in range(now, window.size):
            least[ages.old[tried, i], i] = min(least[ages.old[tried, i], i], error)
    best = min(least[0, now], least[1, now])
    if best > FITS * rough:
        return False, chosen
    for i in range(now, window.size):
        gains[0, i - now] += least[0, i] - least[1, i]
    return best < FITS * once, chosen
