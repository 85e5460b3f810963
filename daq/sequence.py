"""Sequence numbers of a device: every sample is delivered once, or counted as lost.

32-bit counters are unwrapped, repeated samples dropped and counted, and gaps reported exactly. A
restarted device is recognised by its boot number or, if it keeps that, by a counter that goes back
although its clock does not. A boot that has ended does not come back at once: where two take turns,
two devices send on one line, and the one that came last is read alone.
"""

import zlib
from dataclasses import dataclass, replace

import numpy as np

from daq.adapter import RawBlock, picked
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.shared_numbers import Shared, shared

_U32 = 1 << 32
_REPEATS = 1024
"""A sample at most this far behind the newest may be a repeat; farther back is a new count."""
_LONG_HOLE = 1024
"""From this many missing samples on, the device's clock must confirm the elapsed time."""

_TURNS_NS = 2_000_000_000
"""Time within which a boot that returns is that of a second device, not of a restart [ns]."""

_REPEATS_IN_A_ROW = 64
"""More repeats than this in a row mean a new count."""


@dataclass(frozen=True, slots=True)
class Hole:
    """Samples `first` to `last` of `boot` are missing; `last` < `first` if unknown."""

    boot: int
    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Restart:
    """The device started a new count: samples carry `boot` from now on."""

    boot: int
    before: int
    reason: str


Step = RawBlock | Hole | Restart
_DEVICE_BOOT, BOOT, SEQ, _US, _ARRIVED, _REPEATS_SO_FAR = range(6)
"""Places of a tracker's numbers in its `count`: of the samples `BOOT`, of the last one `SEQ`."""
_REPEATED: list[Step] = []
"""Marks a sample as a repeat; compared by identity, distinct from "nothing to report"."""


class SequenceTracker:
    """Turns raw blocks into runs of consecutive, unwrapped samples, and reports gaps.

    Args:
        rate: nominal sample rate [Hz].

    Attributes:
        duplicates: samples dropped as repeats.
        lost: samples known to be lost.
        foreign: samples of a second device, dropped.
    """

    _device_boot = Shared[int]("_count", _DEVICE_BOOT)
    """-1 for none."""
    boot = Shared[int]("_count", BOOT)
    """That of the samples delivered."""
    _seq = Shared[int]("_count", SEQ)
    _us = Shared[int]("_count", _US)
    _arrived = Shared[int]("_count", _ARRIVED)
    _repeats = Shared[int]("_count", _REPEATS_SO_FAR)

    def __init__(self, rate: float) -> None:
        self.duplicates = self.foreign = 0
        self._left: dict[int, int] = {}
        self.lost = 0
        self._count = shared(6, np.int64)
        self._period_us = 1e6 / rate
        self._device_boot = self._seq = -1
        self._recounts = 0
        self._repeat, self._rising = -2, 0
        nothing = np.zeros(0, np.int64)
        take_next(self.count, 0, nothing, nothing, nothing, nothing)  # compiled before it is needed

    @property
    def count(self) -> IntArray:
        """Where it stands, for `take_next`."""
        return np.asarray(self._count)

    def accept(self, raw: RawBlock) -> list[Step]:
        """The steps in `raw`, in order: runs, with gaps and restarts between them."""
        next_ones = self._next_ones(raw)
        if next_ones is not None:
            return [next_ones]
        steps: list[Step] = []
        run = _Run(self.boot)
        rows = zip(raw.seq.tolist(), raw.device_us.tolist(), raw.arrived_ns.tolist(), strict=True)
        for index, (seq, us, arrived) in enumerate(rows):
            found = self._place(raw.boot, seq, us, arrived)
            if found is _REPEATED:
                continue
            if found:
                steps += run.of(raw)
                steps += found
                run = _Run(self.boot)
            run.add(index, self._seq, self._us)
        return steps + run.of(raw)

    def _next_ones(self, raw: RawBlock) -> RawBlock | None:
        """The whole block, unwrapped, if each sample is the next one of the same boot."""
        seq, told, arrived = (
            np.ascontiguousarray(one, np.int64) for one in (raw.seq, raw.device_us, raw.arrived_ns)
        )
        first, device_us = self._seq + 1, np.empty(len(raw), np.int64)
        if not take_next(self.count, raw.boot, seq, told, arrived, device_us):
            return None
        seq = np.arange(first, self._seq + 1)
        return RawBlock(
            self.boot, seq, device_us, raw.codes, raw.arrived_ns, raw.calibrated, raw.quality
        )

    def _place(self, boot: int, seq: int, us: int, arrived: int) -> list[Step]:
        """Add one sample; what is reported before it, or `_REPEATED`."""
        if boot != self._device_boot and self._is_foreign(boot, arrived):
            self.foreign += 1
            return _REPEATED
        if boot != self._device_boot:
            reason = "the device has started anew" if self._device_boot >= 0 else ""
            return self._begin(boot, seq, us, arrived, reason)
        ahead = _signed(seq - self._seq)
        elapsed_us = (arrived - self._arrived) // 1000
        later_us = elapsed_us + _signed(us - self._us - elapsed_us)
        if ahead <= 0 and self._is_repeated(ahead, later_us):
            self._count_repeat(seq)
            return _REPEATED
        if ahead <= 0 or (ahead > _LONG_HOLE and not self._plausible(ahead, later_us)):
            return self._begin(boot, seq, us, arrived, f"its counter jumped by {ahead}")
        hole: list[Step] = []
        if ahead > 1:
            self.lost += ahead - 1
            hole = [Hole(self.boot, self._seq + 1, self._seq + ahead - 1)]
        self._seq, self._us, self._arrived = self._seq + ahead, self._us + later_us, arrived
        self._repeats = 0
        return hole

    def _is_foreign(self, boot: int, arrived: int) -> bool:
        """Whether a boot returns that was left just now, while the one that followed goes on."""
        since = arrived - _TURNS_NS
        self._left = {one: at for one, at in self._left.items() if at > since}
        if boot in self._left and self._arrived > since:
            self._left[boot] = arrived
            return True
        if self._device_boot >= 0:
            self._left[self._device_boot] = self._arrived
        return False

    def _is_repeated(self, ahead: int, later_us: int) -> bool:
        same_clock = abs(later_us - ahead * self._period_us) < self._period_us
        return -ahead < _REPEATS and same_clock and self._repeats < _REPEATS_IN_A_ROW

    def _count_repeat(self, seq: int) -> None:
        self.duplicates += 1
        self._repeats += 1
        self._rising = self._rising + 1 if seq == self._repeat + 1 else 1
        self._repeat = seq

    def _plausible(self, ahead: int, later_us: int) -> bool:
        expected = ahead * self._period_us
        return 0.2 * expected < later_us < 5.0 * expected

    def _begin(self, boot: int, seq: int, us: int, arrived: int, reason: str) -> list[Step]:
        """Start a new count; if the device kept its boot, derive a new one from it."""
        before, first, last = self.boot, self._seq + 1, self._seq
        taken = self._taken_for_repeats(boot, seq)
        self._recounts = self._recounts + 1 if boot == self._device_boot else 0
        self._device_boot, self._seq, self._us, self._arrived = boot, seq, us, arrived
        self.boot = zlib.crc32(f"{boot}/{self._recounts}".encode()) if self._recounts else boot
        self._repeats = 0
        if not reason:
            return [Restart(self.boot, 0, "")]
        mistaken = [Hole(self.boot, seq - taken, seq - 1)] if taken else []
        return [Hole(before, first, last), Restart(self.boot, before, reason), *mistaken]

    def _taken_for_repeats(self, boot: int, seq: int) -> int:
        """Samples up to `seq` of a count that began anew, dropped as repeats: they are lost."""
        goes_on = boot == self._device_boot and self._repeats > 0 and seq == self._repeat + 1
        taken = self._rising if goes_on else 0
        self.duplicates -= taken
        self.lost += taken
        return taken


class _Run:
    """Consecutive samples of one block."""

    def __init__(self, boot: int) -> None:
        self._boot = boot
        self._index: list[int] = []
        self._seq: list[int] = []
        self._us: list[int] = []

    def add(self, index: int, seq: int, us: int) -> None:
        self._index.append(index)
        self._seq.append(seq)
        self._us.append(us)

    def of(self, raw: RawBlock) -> list[Step]:
        """The run as a block, or nothing if it is empty."""
        if not self._index:
            return []
        kept = picked(raw, self._index)
        seq, us = np.array(self._seq, np.int64), np.array(self._us, np.int64)
        return [replace(kept, boot=self._boot, seq=seq, device_us=us)]


@kernel()
def take_next(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    count: IntArray,
    boot: int,
    seq: IntArray,
    told_us: IntArray,
    arrived: IntArray,
    unwrapped: IntArray,
) -> bool:
    """Take all samples if each is the next one of the same boot, as nearly always.

    What `SequenceTracker.accept` does with each of them alone, in a small part of its time.

    Args:
        count: of the tracker.
        boot: of the samples.
        seq, told_us: shape (n,), as the device told them.
        arrived: shape (n,) [ns].
        unwrapped: shape (n,), filled: the device's clock [µs].

    Returns:
        Whether they were taken; otherwise the tracker is as before.
    """
    if not seq.size or boot != count[_DEVICE_BOOT] or _signed_part(seq[0] - count[SEQ]) != 1:
        return False
    for k in range(1, seq.size):
        if seq[k] != seq[0] + k:
            return False
    us, before = count[_US], count[_ARRIVED]
    for k in range(seq.size):
        elapsed_us = (arrived[k] - before) // 1000
        us += elapsed_us + _signed_part(told_us[k] - us - elapsed_us)
        before = arrived[k]
        unwrapped[k] = us
    count[SEQ] += seq.size
    count[_US], count[_ARRIVED], count[_REPEATS_SO_FAR] = us, before, 0
    return True


def _signed(difference: int) -> int:
    """The difference of two 32-bit counters, allowing for wraps of either."""
    return (difference + _U32 // 2) % _U32 - _U32 // 2


_signed_part = part()(_signed)
