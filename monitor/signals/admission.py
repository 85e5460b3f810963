"""Admission of samples: gaps, restarts and invalid readings become one code per sample.

A short run of missing or invalid samples is bridged: the last good value is held for the filters,
and the sample is excluded from the estimates. After a longer run nothing is fed until a good sample
arrives, which restarts every filter. Missing samples are inserted as held ones, so that sample
counts and periods stay aligned.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import NON_FINITE, SATURATED, SPIKE, STALE, Column, SampleBlock, valid

GOOD, HELD, DEAD, RESTART, NEW_BOOT = 0, 1, 2, 3, 4
"""Codes: good; held; nothing to feed; good after a dead stretch; good and the first of a new boot.
"""

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
    """

    def __init__(
        self, channels: tuple[str, ...], needed: tuple[str, ...], longest_hold: int
    ) -> None:
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
        code = np.empty(len(values), np.int64)
        run = np.empty(len(values), np.int64)
        needed_good = np.asarray(good[:, self._needed].all(axis=1))
        _classify(values, good, needed_good, self._last, self._run, self._hold, code, run)
        self._fresh = self._fresh or new_boot
        self._mark_new_boot(code)
        missing = -1 if new_boot and self._boot is not None else missing
        self._boot, self._next = block.boot, block.seq + len(block)
        first = block.seq + seen - padding
        position_valid = good[:, min(1, good.shape[1] - 1)]
        seq = np.arange(first, first + len(values), dtype=np.int64)
        valid_position = position_valid.astype(np.uint8)
        return Admitted(values, code, valid_position, seq, padding, missing, run, good)

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
    """Finite and of good quality; a constant position may be stiction, so it counts as good."""
    finite = np.isfinite(column.values)
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
    last: FloatArray,
    run: Codes,
    longest_hold: int,
    code: Codes,
    runs: Codes,
) -> None:
    """Fill in held values and write the codes; updates `last` and `run`."""
    for k in range(code.size):
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
