"""Admission of samples: gaps, restarts and invalid readings become one code per sample.

A short run of missing or invalid samples is bridged: the last good value is held until the filters
know the next one, and the sample is excluded from the estimates. After a longer run nothing is fed
until a good sample arrives, which restarts every filter. Missing samples are inserted as held ones,
so that sample counts and periods stay aligned. Numbers that follow one another do not show a device
that has paused, or whose clock has jumped: its clock does, and restarts the filters as well.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import (
    NON_FINITE,
    RESAMPLED,
    SATURATED,
    SPIKE,
    STALE,
    ByteArray,
    Column,
    SampleBlock,
    quality_flags,
)

LARGEST = 1e9
"""Magnitude in SI units that no signal of a rig has; a larger reading is none."""
GOOD, HELD, DEAD, RESTART, NEW_BOOT = 0, 1, 2, 3, 4
"""Codes: good; held; nothing to feed; good after a dead stretch; good and the first of a new boot.
"""

INVALID, POSITION_INVALID = quality_flags.INVALID, STALE | SATURATED | NON_FINITE | SPIKE
"""Flags that make a reading invalid, and a position: that it is constant may be stiction."""
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
        bridged: whether each reading is held or interpolated, shape (n, c).
    """

    signals: FloatArray
    code: Codes
    position_valid: NDArray[np.uint8]
    seq: Codes
    padding: int
    missing: int
    invalid_run: Codes
    good: NDArray[np.bool_]
    bridged: NDArray[np.bool_]


class SteadyAdmission(NamedTuple):
    """What a kernel needs to admit a block that follows the last one and has only good readings."""

    needed: NDArray[np.bool_]
    last: FloatArray
    run: Codes
    clock: Codes
    longest_hold: int
    period_us: float


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
        self._clock = np.zeros(4, np.int64)
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
        values, good, made = self._columns(block, seen, padding)
        broken = np.zeros(len(values), np.bool_)
        self._clock[0], self._clock[1] = missing, new_boot
        _find_breaks(block.device_us[seen:], self._period_us, self._clock, broken[padding:])
        code, run = np.empty((2, len(values)), np.int64)
        _classify(values, good, self._needed, broken, self._last, self._run, self._hold, code, run)
        self._fresh = self._fresh or new_boot
        self._mark_new_boot(code)
        missing = -1 if new_boot and self._boot is not None else missing
        self._boot, self._next = block.boot, block.seq + len(block)
        first = block.seq + seen - padding
        position_valid = good[:, min(1, good.shape[1] - 1)]
        seq = np.arange(first, first + len(values), dtype=np.int64)
        valid_position = position_valid.astype(np.uint8)
        bridged = ~good | made
        return Admitted(values, code, valid_position, seq, padding, missing, run, good, bridged)

    def steady(self) -> SteadyAdmission:
        """The state that `admit_steady` continues; `passed` is told of each block it admits."""
        return SteadyAdmission(
            self._needed, self._last, self._run, self._clock, self._hold, self._period_us
        )

    def continues(self, boot: int, seq: int) -> bool:
        """Whether a sample follows the last one of a boot that has had a good one."""
        return boot == self._boot and seq == self._next and not self._fresh

    def passed(self, samples: int) -> None:
        """So many samples have been admitted by `admit_steady`."""
        self._next += samples

    def begin_again(self) -> None:
        """Restart every filter with the next good sample."""
        self._run[0] = self._hold + 1

    def _mark_new_boot(self, code: Codes) -> None:
        """The first good sample of a boot restarts more than the filters."""
        if not self._fresh:
            return
        good = np.flatnonzero(code == RESTART)
        if good.size:
            code[good[0]] = NEW_BOOT
            self._fresh = False

    def _columns(
        self, block: SampleBlock, seen: int, padding: int
    ) -> tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
        """Values, whether each is good, and whether it is interpolated, all of shape (n, c)."""
        n = len(block) - seen + padding
        values = np.zeros((n, len(self._channels)))
        flags = np.zeros(values.shape, np.uint8)
        for place, name in enumerate(self._channels):
            column = block.channel(name)
            values[padding:, place] = column.values[seen:]
            if column.quality.size:
                flags[padding:, place] = column.quality[seen:]
        good = np.zeros(values.shape, np.bool_)
        _find_good(values, flags, padding, good)
        return values, good, (flags & RESAMPLED) > 0


@kernel()
def _find_good(values: FloatArray, flags: ByteArray, padding: int, good: NDArray[np.bool_]) -> None:
    """Mark the readings that `usable` accepts, and set the others to 0."""
    for k in range(values.shape[0]):
        for c in range(values.shape[1]):
            bad = flags[k, c] & (POSITION_INVALID if c == 1 else INVALID)
            good[k, c] = k >= padding and bad == 0 and abs(values[k, c]) <= LARGEST
            if not good[k, c]:
                values[k, c] = 0.0


@kernel(allocates=True)
def admit_steady(  # noqa: PLR0917
    state: SteadyAdmission,
    values: FloatArray,
    places: Codes,
    device_us: Codes,
    signals: FloatArray,
    good: NDArray[np.bool_],
    code: Codes,
    run: Codes,
) -> bool:
    """Admit a block that follows the last one, if all its readings are good and its clock is even.

    Otherwise the state is as before, and `Admission.admit` takes the block.

    Args:
        state: from `Admission.steady`.
        values: a row for each of the block's channels, without flags, shape (any, n).
        places: rows of the model's channels, shape (c,).
        device_us: shape (n,).
        signals, good, code, run: filled as in `Admitted`.
    """
    for k in range(code.size):
        for c in range(places.size):
            signals[k, c] = values[places[c], k]
    _find_good(signals, np.zeros(signals.shape, np.uint8), 0, good)
    clock, last, running = state.clock.copy(), state.last.copy(), state.run.copy()
    clock[0] = clock[1] = 0
    broken = np.zeros(code.size, np.bool_)
    _find_breaks(device_us, state.period_us, clock, broken)
    hold = state.longest_hold
    _classify(signals, good, state.needed, broken, last, running, hold, code, run)
    if not good.all() or (code != GOOD).any():
        return False
    state.clock[:], state.last[:], state.run[:] = clock, last, running
    return True


@kernel()
def _find_breaks(device_us: Codes, period: float, clock: Codes, broken: NDArray[np.bool_]) -> None:
    """Mark where the device's clock does not follow the sample numbers, as it did before.

    `clock` holds the samples missing before the block and whether a boot begins with it, and
    carries the clock's last value [µs] and the number of even steps before it.
    """
    for k in range(device_us.size):
        expected = period * (clock[0] + 1) if k == 0 else period
        first = k == 0 and clock[1] != 0
        follows = not first and abs(device_us[k] - clock[2] - expected) <= JUMP * period
        clock[2] = device_us[k]
        if period > 0.0 and not follows:
            broken[k] = clock[3] >= PROVEN and not first
            clock[3] = 0
        else:
            clock[3] += 1


def usable(column: Column, stuck_counts: bool) -> NDArray[np.bool_]:
    """Finite, possible and of good quality; a constant position may be stiction: it counts."""
    finite = np.abs(column.values) <= LARGEST  # also false for NaN
    if column.quality.size == 0:
        return finite
    invalid = INVALID if stuck_counts else POSITION_INVALID
    return np.asarray(finite & ((column.quality & invalid) == 0))


@kernel()
def _classify(  # noqa: PLR0917
    values: FloatArray,
    good: NDArray[np.bool_],
    needed: NDArray[np.bool_],
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
        all_good = True
        for c in range(last.size):
            all_good &= good[k, c] or not needed[c]
        run[0] = 0 if all_good else was + 1
        if all_good:
            code[k] = RESTART if was > longest_hold else GOOD
        else:
            code[k] = HELD if run[0] <= longest_hold else DEAD
        runs[k] = run[0]
        for c in range(last.size):
            if good[k, c]:
                last[c] = values[k, c]
            else:
                values[k, c] = last[c]
