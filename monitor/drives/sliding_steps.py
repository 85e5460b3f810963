"""Where between samples an input steps that a generator holds on a clock of its own.

A converter that updates at nearly the sample rate, on another clock, is seen as a staircase whose
steps slide over the samples: each step falls a share f of an interval before the next sample, and f
drifts from 0 to 1 and begins anew. As it does, a sample skips a step of the generator or repeats
one. A skip shows in the input alone: the samples before it and those after it lie on one smooth
curve if time is moved by one sample between them, and on none if it is not. Skips follow each other
regularly, so two intervals between them give f at every sample, and the input's mean from sample j
to the next is

    (1 - f)·u[j] + f·u[j + 1].
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.drives.reading_ages import DEGREE
from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel, part

CLEAR, FITS, USUALLY = 20.0, 0.1, 8.0
"""A step was skipped if the squared error without moved time is above the first multiple of the
usual one, and that with it below a share of that without and below the last multiple.
"""
PACE = 0.06
"""Relative change with every sample of the usual error, a running median."""
SHORTEST, LONGEST = 40.0, 4096.0
"""Intervals between skips that are followed [samples]: clocks that differ by 2.5 to 0.025 %."""
REGULAR, MISSED = 0.04, 32
"""Relative error of regular intervals, and most skips missed in a row."""
SURE, STRAYS = 3, 3
"""Regular skips after which f is known, and irregular ones in a row after which it is not."""
FORGET = 0.3
"""Weight of the newest interval."""
ALONE = 1024.0
"""Samples after which a skip that none follows is taken for a jump of the drive's phase. The next
one of a slower clock is still counted.
"""


class Sliding(NamedTuple):
    """An input at the samples `half_width` before those given, both of shape (n,).

    Attributes:
        mean: its mean until the next sample; 0 with too few samples.
        known: False while its steps slide and their clock is not yet known.
        followed: whether they slide and their clock is known.
    """

    mean: FloatArray
    known: BoolArray
    followed: BoolArray


class SlidingSteps:
    """Follows the steps of one input, block by block.

    Args:
        half_width: samples on either side of a skip from which it is told; results lag by it.
    """

    def __init__(self, half_width: int) -> None:
        self._misfits = np.stack([_misfit(half_width, moved) for moved in (0, 1, -1)])
        self._ring = np.zeros(2 * half_width)
        self._kept = np.zeros(len(_AT))

    def update(self, signal: FloatArray, code: Codes) -> Sliding:
        """The next samples of the input, shape (n,), with states of the admission."""
        mean, known = np.zeros(code.size), np.ones(code.size, np.bool_)
        followed = np.zeros(code.size, np.bool_)
        _advance(
            np.ascontiguousarray(signal), code, self._misfits, self._ring, self._kept,
            mean, known, followed,
        )  # fmt: skip
        return Sliding(mean, known, followed)


def _misfit(half_width: int, moved: int) -> FloatArray:
    """Projection onto what no polynomial fits, time moved between the halves of a window."""
    at = np.arange(2 * half_width, dtype=np.float64)
    at[half_width:] += moved
    powers = np.vander(at / half_width - 1.0, DEGREE + 1)
    smooth, _ = np.linalg.qr(powers)
    return np.asarray(np.eye(at.size) - smooth @ smooth.T)


class _At(NamedTuple):
    """Indices of the carried figures: those of the ring, of the usual error, of the last skip."""

    head: int = 0
    filled: int = 1
    usual: int = 2
    age: int = 3
    interval: int = 4
    skips: int = 5
    way: int = 6
    stray: int = 7


_AT = _At()
HEAD, FILLED, USUAL, AGE, INTERVAL, SKIPS, WAY, STRAY = _AT


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    signal: FloatArray,
    code: Codes,
    misfits: FloatArray,
    ring: FloatArray,
    kept: FloatArray,
    mean: FloatArray,
    known: NDArray[np.bool_],
    followed: NDArray[np.bool_],
) -> None:
    size = ring.size
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
        if code[k] == DEAD:
            continue
        head = int(kept[HEAD])
        ring[head] = signal[k]
        head = (head + 1) % size
        kept[HEAD] = head
        kept[FILLED] += 1
        kept[AGE] += 1
        if kept[FILLED] < size:
            continue
        way = _skipped(misfits, ring, kept)
        share = _share(kept)
        now, following = ring[(head + size // 2 - 1) % size], ring[(head + size // 2) % size]
        if way > 0 and kept[SKIPS] >= SURE:
            # The step that no sample shows lies between the two that do.
            share, following = 1.0, 0.5 * (now + following)
        mean[k] = (1.0 - share) * now + share * following
        followed[k] = kept[SKIPS] >= SURE
        known[k] = kept[SKIPS] == 0 or followed[k] or kept[AGE] > ALONE
        if way != 0:
            _follow(way, kept)
        elif _lost(kept):
            kept[SKIPS] = 0


@part()
def _skipped(misfits: FloatArray, ring: FloatArray, kept: FloatArray) -> int:
    """1 if the middle of the ring skips a step, -1 if it repeats one, else 0."""
    plain = _energy(misfits[0], ring, int(kept[HEAD]))
    usual = kept[USUAL]
    way = 0
    if plain > CLEAR * usual and usual > 0.0:
        for tried in (1, 2):
            if _energy(misfits[tried], ring, int(kept[HEAD])) < min(FITS * plain, USUALLY * usual):
                way = 1 if tried == 1 else -1
    if usual == 0.0:
        kept[USUAL] = plain
    elif way == 0 and plain > 0.0:
        kept[USUAL] *= 1.0 + PACE if plain > usual else 1.0 - PACE
    return way


@part()
def _energy(misfit: FloatArray, ring: FloatArray, head: int) -> float:
    total = 0.0
    for i in range(ring.size):
        left = 0.0
        for j in range(ring.size):
            left += misfit[i, j] * ring[(head + j) % ring.size]
        total += left * left
    return total


@part()
def _share(kept: FloatArray) -> float:
    """f, from the time since the last skip and the interval between skips."""
    if kept[SKIPS] < SURE:
        return 0.0
    gone = (kept[AGE] / kept[INTERVAL]) % 1.0
    return gone if kept[WAY] > 0.0 else 1.0 - gone


@part()
def _follow(way: int, kept: FloatArray) -> None:
    """Take a skip as the next of a regular clock, as a stray one, or as the first of another."""
    age, interval = kept[AGE], kept[INTERVAL]
    refined = _refined(age, interval) if kept[SKIPS] >= 2.0 and way == kept[WAY] else 0.0
    if refined > 0.0:
        kept[INTERVAL] = refined
        kept[SKIPS], kept[STRAY], kept[AGE] = min(kept[SKIPS] + 1.0, SURE), 0.0, 0.0
        return
    kept[STRAY] += 1.0
    if kept[SKIPS] >= SURE and kept[STRAY] < STRAYS:
        return
    second = kept[SKIPS] >= 1.0 and way == kept[WAY] and SHORTEST <= age <= LONGEST
    kept[SKIPS], kept[INTERVAL] = (2.0, age) if second else (1.0, 0.0)
    if second and _regular(interval, age):
        kept[SKIPS] = SURE
    kept[WAY], kept[STRAY], kept[AGE] = way, 0.0, 0.0


@part()
def _refined(age: float, interval: float) -> float:
    """The interval between skips after a regular one, 0 after another."""
    if _regular(age, interval):
        return interval + (age / _parts(age, interval) - interval) * FORGET
    if age >= SHORTEST and _regular(interval, age):
        # Skips at the corners of a drive are not seen: the interval was one of several.
        return interval / _parts(interval, age)
    return 0.0


@part()
def _parts(whole: float, part: float) -> float:
    return max(np.round(whole / part), 1.0)


@part()
def _regular(age: float, interval: float) -> bool:
    """Whether a time holds a whole number of intervals; a skip is told to a sample."""
    if interval <= 0.0:
        return False
    parts = _parts(age, interval)
    return abs(age - parts * interval) <= max(REGULAR * min(parts, 2.0) * interval, 1.0)


@part()
def _lost(kept: FloatArray) -> bool:
    """Whether too many skips are missing."""
    if kept[SKIPS] == 0.0:
        return False
    if kept[SKIPS] == 1.0:
        return kept[AGE] > LONGEST
    return kept[AGE] > MISSED * kept[INTERVAL]
