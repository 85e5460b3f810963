"""Admission of samples: gaps, restarts and invalid readings become one code per sample.

A short run of missing or invalid samples is bridged: the last good value is held for the filters,
and the sample is excluded from the estimates. After a longer run nothing is fed until a good sample
arrives, which restarts every filter. Missing samples are inserted as held ones, so that sample
counts and periods stay aligned. Numbers that follow one another do not show a device that has
paused, or whose clock has jumped: its clock does, and restarts the filters as well.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import NON_FINITE, SATURATED, SPIKE, STALE, Column, SampleBlock, valid

LARGEST = 1e9
"""Magnitude in SI units that no signal of a rig has; a larger reading is none."""
GOOD, HELD, DEAD, RESTART, NEW_BOOT = 0, 1, 2, 3, 4
"""Codes: good; held; nothing to feed; good after a dead stretch; good and the first of a new boot.
"""

JUMP = 2.5
"""Deviation of a device's clock from its sample numbers that is a jump [periods]."""
PROVEN = 16
"""Steps of one period after which a device's clock is trusted."""

Codes = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Admitted:
    """Samples prepared for the stages.

    Args:
        signals: one row per sample, one column per channel, held where not good, shape (n, c).
        code: shape (n,).
        position_valid: 1 if the second channel may be judged, shape (n,).
        seq: number of each sample, shape (n,).
        padding: number of inserted samples at the start.
        missing: samples known to be missing before the block, -1 for an unknown number.
        invalid_run: samples without a good reading up to and with this one, shape (n,).
        good: whether each reading is one, shape (n, c).
    """

    signals: FloatArray
    code: Codes
    position_valid: NDArray[np.uint8]
    seq: Codes
    padding: int
    missing: int
    invalid_run: Codes
    good: NDArray[np.bool_]


class Admission:
    """Keeps the last good sample and the count of bad ones from block to block.

    Args:
        channels: names of the channels in the order of the columns.
        needed: which of them the residual needs; the others may be invalid.
        longest_hold: longest run of samples that is bridged.
        sample_rate: of the device [Hz]; None leaves its clock unchecked.
    """

    def __init__(
        self,
        channels: tuple[str, ...],
        needed: tuple[str, ...],
        longest_hold: int,
        sample_rate: float | None = None,
    ) -> None:
        self._period_us = 1e6 / sample_rate if sample_rate else 0.0
        self._even, self._us = 0, 0
        self._channels, self._hold = channels, longest_hold
        self._needed = np.array([name in needed for name in channels])
        self._last = np.zeros(len(channels))
        self._run = np.array([longest_hold + 1], np.int64)
        self._boot: int | None = None
        self._next = 0
        self._fresh = False

    def admit(self, block: SampleBlock) -> Admitted | None:
        """The block's samples with their codes; None if all of them are repeats.

        Raises:
            KeyError: the block lacks a channel.
        """
        new_boot = block.boot != self._boot
        seen = 0 if new_boot else max(self._next - block.seq, 0)
        if seen >= len(block):
            return None
        missing = 0 if new_boot or seen else block.seq - self._next
        padding = missing if missing <= self._hold else 0
        if missing > self._hold or new_boot:
            self._run[0] = self._hold + max(missing, 1)
        values, good = self._columns(block, seen, padding)
        broken = np.zeros(len(values), np.bool_)
        broken[padding:] = self._clock_breaks(block.device_us[seen:], missing, new_boot)
        code = np.empty(len(values), np.int64)
        run = np.empty(len(values), np.int64)
        needed_good = np.asarray(good[:, self._needed].all(axis=1))
        _classify(values, good, needed_good, broken, self._last, self._run, self._hold, code, run)
        self._fresh = self._fresh or new_boot
        self._mark_new_boot(code)
        missing = -1 if new_boot and self._boot is not None else missing
        self._boot, self._next = block.boot, block.seq + len(block)
        first = block.seq + seen - padding
        position_valid = good[:, min(1, good.shape[1] - 1)]
        seq = np.arange(first, first + len(values), dtype=np.int64)
        valid_position = position_valid.astype(np.uint8)
        return Admitted(values, code, valid_position, seq, padding, missing, run, good)

    def _clock_breaks(self, device_us: Codes, missing: int, new_boot: bool) -> NDArray[np.bool_]:
        """Where the device's clock does not follow the sample numbers, as it did before."""
        steps = np.diff(device_us, prepend=self._us)
        expected = np.full(len(steps), self._period_us)
        expected[0] *= missing + 1
        even = np.abs(steps - expected) <= JUMP * self._period_us
        even[0] &= not new_boot
        self._us = int(device_us[-1])
        broken = np.zeros(len(steps), np.bool_)
        if not self._period_us or even.all():
            self._even += len(steps)
            return broken
        for k, follows in enumerate(even):
            broken[k] = not follows and self._even >= PROVEN and not (k == 0 and new_boot)
            self._even = self._even + 1 if follows else 0
        return broken

    def _mark_new_boot(self, code: Codes) -> None:
        """The first good sample of a boot restarts more than the filters."""
        good = np.flatnonzero(code == RESTART)
        if self._fresh and good.size:
            code[good[0]] = NEW_BOOT
            self._fresh = False

    def _columns(
        self, block: SampleBlock, seen: int, padding: int
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        n = len(block) - seen + padding
        values = np.zeros((n, len(self._channels)))
        good = np.zeros((n, len(self._channels)), np.bool_)
        for place, name in enumerate(self._channels):
            column = block.channel(name)
            values[padding:, place] = column.values[seen:]
            good[padding:, place] = usable(column, stuck_counts=place != 1)[seen:]
        values[~good] = 0.0
        return values, good


def usable(column: Column, stuck_counts: bool) -> NDArray[np.bool_]:
    """Finite, possible and of good quality; a constant position may be stiction: it counts."""
    finite = np.abs(column.values) <= LARGEST  # also false for NaN
    if column.quality.size == 0:
        return finite
    if stuck_counts:
        return np.asarray(finite & valid(column.quality))
    return np.asarray(finite & ((column.quality & (STALE | SATURATED | NON_FINITE | SPIKE)) == 0))


@kernel()
def _classify(  # noqa: PLR0917
    values: FloatArray,
    good: NDArray[np.bool_],
    needed_good: NDArray[np.bool_],
    broken: NDArray[np.bool_],
    last: FloatArray,
    run: Codes,
    longest_hold: int,
    code: Codes,
    runs: Codes,
) -> None:
    """Fill in held values and write the codes; updates `last` and `run`."""
    for k in range(code.size):
        if broken[k]:
            run[0] = longest_hold + 1
        was = run[0]
        run[0] = 0 if needed_good[k] else was + 1
        if needed_good[k]:
            code[k] = RESTART if was > longest_hold else GOOD
        else:
            code[k] = HELD if run[0] <= longest_hold else DEAD
        runs[k] = run[0]
        for c in range(last.size):
            if good[k, c]:
                last[c] = values[k, c]
            else:
                values[k, c] = last[c]
