"""A drive's frequency, and sudden changes of it or of the amplitude, from the input alone.

    ψ(u) = u² - u₋ₘ·u₊ₘ,   2·sin(m·Ω/2) = √(⟨ψ(Δu)⟩/⟨ψ(u)⟩),   Δu = u - u₋ₘ

The energy operator ψ is constant for a tone, A²·sin²mΩ, so a mean over a few samples gives its
frequency Ω without ripple (P. Maragos, J. F. Kaiser, T. F. Quatieri, IEEE Trans. Signal Processing
41, 1993). Other periodic drives have a ripple, which is compared with what it was before. The
transient after a change is no fault, and the motion's own spectrum shows a change too late to tell.
A drive without a ripple is also followed with a shorter memory, which sees its change while the
motion has hardly begun to differ.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill, push
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel

SLOW = 128.0
"""Memory of what the frequency was before [samples]."""
LEAST, BROAD = 0.08, 0.35
"""Least change of the frequency's logarithm that is a change of the drive, and the usual change
above which the drive has no frequency.
"""
SECTION = 256.0
"""Samples over which the usual change is the largest; the last two complete ones count."""
STILL, KEEPS = 1e-4, 0.9999
"""ψ relative to its largest below which there is no drive, and what is left of the largest after a
sample.
"""
LARGEST, SQUARED, BENT, WAS, SEEN, NEWEST, LAST, BEFORE = range(8)
"""Carried figures: the largest mean of ψ(u), means of ψ(u) and of ψ(Δu), the logarithm of the
frequency before, the number of samples with a drive, and largest changes of three sections.
"""


class Memory(NamedTuple):
    """How a frequency is followed.

    Attributes:
        apart: m [samples]: more is less sensitive to noise, and limits Ω to π/2m.
        mean: memory of the frequency [samples].
        ripple: ratio to the usual change above which it is a change of the drive; a short memory
            leaves noise, whose largest values vary.
    """

    apart: int
    mean: float
    ripple: float


LONG, SHORT = Memory(4, 24.0, 1.5), Memory(2, 4.0, 2.5)


class Drive(NamedTuple):
    """An input, both of shape (n,).

    Attributes:
        changed: whether it changes suddenly.
        pace: 2·sin(m·Ω/2) of the last half second, which also tells a sine from a triangle or a
            square of the same frequency; 0 without a drive.
    """

    changed: BoolArray
    pace: FloatArray


class DriveChanges:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._long, self._short = _Followed(LONG), _Followed(SHORT)

    def update(self, signal: FloatArray, code: Codes) -> Drive:
        """The drive at each sample of a signal of shape (n,)."""
        slow, fast = (each.update(signal, code) for each in (self._long, self._short))
        return Drive(slow.changed | fast.changed, slow.pace)


class _Followed:
    """An input followed with one memory."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._last = np.zeros(3 * memory.apart + 1)
        self._kept = np.zeros(8)

    def update(self, signal: FloatArray, code: Codes) -> Drive:
        found = Drive(np.zeros(code.size, np.bool_), np.zeros(code.size))
        carried = self._last, self._kept
        _advance(np.ascontiguousarray(signal), code, *self._memory, *carried, *found)
        return found


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    signal: FloatArray,
    code: Codes,
    apart: int,
    mean: float,
    ripple: float,
    last: FloatArray,
    kept: FloatArray,
    changed: NDArray[np.bool_],
    pace: FloatArray,
) -> None:
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
            fill(last, signal[k])
        if code[k] == DEAD:
            continue
        push(last, signal[k])
        a, b, c, e = last[0], last[apart], last[2 * apart], last[3 * apart]
        squared = c * c - b * e
        first, middle, second = b - a, c - b, e - c
        bent = middle * middle - first * second
        kept[SQUARED] += (squared - kept[SQUARED]) / mean
        kept[BENT] += (bent - kept[BENT]) / mean
        kept[LARGEST] = max(KEEPS * kept[LARGEST], kept[SQUARED])
        if kept[SQUARED] <= STILL * kept[LARGEST] or kept[BENT] <= 0.0:
            kept[SEEN] = 0.0
            continue
        now = 0.5 * np.log(kept[BENT] / kept[SQUARED])
        if kept[SEEN] < SLOW:
            kept[WAS], kept[NEWEST], kept[LAST], kept[BEFORE] = now, 0.0, BROAD, BROAD
        kept[SEEN] += 1.0
        if kept[SEEN] % SECTION == 0.0:
            kept[BEFORE], kept[LAST], kept[NEWEST] = kept[LAST], kept[NEWEST], 0.0
        change, usual = abs(now - kept[WAS]), max(kept[LAST], kept[BEFORE])
        kept[NEWEST] = max(kept[NEWEST], change)
        changed[k] = change > max(LEAST, ripple * usual) and usual < BROAD
        kept[WAS] += (now - kept[WAS]) / (1.0 if changed[k] else SLOW)
        pace[k] = np.exp(kept[WAS])
