"""The adapter's ring: the latest samples, stored for readers that missed some.

`RingStore` stores the samples of one boot in arrays, sample `seq` in row `seq` modulo the ring's
length, so gaps are preserved. `SampleRing` serves the current boot and the previous one, whose end
readers may still need, and declares a liveliness token for the boot that has control of the rig.
"""

import threading
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.bus import MAX_PAYLOAD, Bus
from rigwatch.wire.messages import RING_KEY, BlockSize, ByteArray, Column, SampleBlock
from rigwatch.wire.ordering import UNKNOWN, Ask, RingReply

SOURCE_KEY = "source"
"""Place of source tokens, named `<boot>/<start as Unix time in ns>/<identity on the bus>`."""
SAMPLES_PER_REPLY, RUNS_PER_REPLY = 1024, 64
"""Largest numbers of samples and of runs of them in a reply, so that replying never delays the
publishing of samples."""
REPLY_BYTES = MAX_PAYLOAD // 2
"""Largest size of a reply [bytes]: samples of many channels fill it before they are too many."""


class RingArrays(NamedTuple):
    """The samples of a `RingStore`: shape (capacity,), of channels (channels, capacity)."""

    seq: IntArray
    device_us: IntArray
    t_ns: IntArray
    values: FloatArray
    quality: ByteArray


class RingStore:
    """The last samples of one boot.

    Args:
        head: a block of that boot; all others have the same columns.
        capacity: number of samples stored.

    Attributes:
        newest: number of the newest sample.
        arrays: the samples, for a compiled call that adds many, whose caller counts up `newest`.
    """

    def __init__(self, head: SampleBlock, capacity: int) -> None:
        n = len(head.channels)
        self.device, self.boot, self.capacity = head.device, head.boot, capacity
        self.layout = _layout(head)
        self.newest = -1
        self._size = BlockSize.of(head)
        self._seq = np.full(capacity, -1, np.int64)
        self._device_us = np.zeros(capacity, np.int64)
        self._t_ns = np.zeros(capacity, np.int64)
        self._values = np.zeros((n, capacity))
        self._quality = np.zeros((n, capacity), np.uint8)
        self.arrays = RingArrays(
            self._seq, self._device_us, self._t_ns, self._values, self._quality
        )

    def add(self, block: SampleBlock) -> None:
        """Store the samples of a block, replacing those `capacity` earlier."""
        keep = slice(max(0, len(block) - self.capacity), len(block))
        seq = np.arange(block.seq, block.seq + len(block))[keep]
        rows = self._rows(int(seq[0]), len(seq))
        self._seq[rows] = seq
        self._device_us[rows] = block.device_us[keep]
        self._t_ns[rows] = block.t_ns[keep]
        for values, quality, channel in zip(
            self._values, self._quality, block.channels, strict=True
        ):
            values[rows] = channel.values[keep]
            if len(channel.quality):
                quality[rows] = channel.quality[keep]
        self.newest = max(self.newest, block.seq + len(block) - 1)

    def _rows(self, first: int, count: int) -> slice | NDArray[np.int64]:
        """Where consecutive samples are stored; as a slice, unless the ring's end divides them."""
        start = first % self.capacity
        if start + count <= self.capacity:
            return slice(start, start + count)
        return np.arange(first, first + count) % self.capacity

    def reply(self, ask: Ask) -> RingReply[SampleBlock]:
        """The requested samples still stored, as many as fit into one reply."""
        last = min(ask.last, self.newest)
        first = min(max(ask.first, self.newest - self.capacity + 1, 0), last + 1)
        # Samples older than the ring are settled as well: they are permanently lost.
        most = min(SAMPLES_PER_REPLY, self._size.samples_in(REPLY_BYTES))
        last = min(last, first + most - 1)
        seq = np.arange(first, last + 1)
        there = seq[self._seq[seq % self.capacity] == seq]
        runs = _runs(there, self._t_ns[there % self.capacity])
        fitting = self._fitting(runs)
        if len(fitting) < len(runs):
            last = int(fitting[-1][-1])
        return RingReply(self.boot, last, tuple(self._block(run) for run in fitting))

    def _fitting(self, runs: list[NDArray[np.int64]]) -> list[NDArray[np.int64]]:
        """The first runs, as many as fit into one reply."""
        sizes = np.cumsum([self._size.frame + self._size.sample * len(run) for run in runs])
        count = int(np.searchsorted(sizes, REPLY_BYTES, side="right"))
        return runs[: min(max(count, 1), RUNS_PER_REPLY)]

    def first(self) -> SampleBlock:
        """The oldest sample stored."""
        return self._block(np.array([self._seq[self._seq >= 0].min()]))

    def empty_block(self, seq: int, count: int) -> SampleBlock:
        """A block of so many zeros, with what all blocks of this boot have in common."""
        none, times = np.zeros(0, np.uint8), np.zeros(count, np.int64)
        columns = [
            Column(name, unit, np.zeros(count), np.zeros(count, np.uint8) if judged else none)
            for name, unit, judged in self.layout
        ]
        return SampleBlock(self.device, self.boot, seq, times, times, tuple(columns))

    def _block(self, seq: NDArray[np.int64]) -> SampleBlock:
        rows = seq % self.capacity
        channels = tuple(
            Column(
                name,
                unit,
                self._values[i, rows],
                self._quality[i, rows] if judged else np.zeros(0, np.uint8),
            )
            for i, (name, unit, judged) in enumerate(self.layout)
        )
        first = int(seq[0])
        return SampleBlock(
            self.device, self.boot, first, self._device_us[rows], self._t_ns[rows], channels
        )


def _layout(block: SampleBlock) -> tuple[tuple[str, str, bool], ...]:
    return tuple((c.name, c.unit, bool(len(c.quality))) for c in block.channels)


def _runs(seq: NDArray[np.int64], t_ns: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Stretches of consecutive numbers over which the clock was not set back."""
    if not len(seq):
        return []
    return np.split(seq, np.flatnonzero((np.diff(seq) != 1) | (np.diff(t_ns) < 0)) + 1)


class SampleRing:
    """The rings of the current and the previous boot, served on the bus.

    Args:
        bus: on which readers send queries.
        capacity: number of samples stored per boot.

    Attributes:
        lock: held while what is stored changes.
    """

    def __init__(self, bus: Bus, capacity: int) -> None:
        self._capacity = capacity
        self._stores: list[RingStore] = []
        self.lock = threading.Lock()
        self._token = bus.named_token(SOURCE_KEY)
        self._close = bus.serve(RING_KEY, self._answer)

    def add(self, block: SampleBlock) -> None:
        """Store a block; to be called before the block is published."""
        if not len(block):
            return
        if not self._stores or self._stores[-1].boot != block.boot:
            self._start(block)
        with self.lock:
            if self._stores[-1].layout != _layout(block):
                self._stores[-1] = RingStore(block, self._capacity)
            self._stores[-1].add(block)

    @property
    def newest(self) -> RingStore | None:
        """Where the block that came last is stored; None before the first."""
        return self._stores[-1] if self._stores else None

    def _start(self, head: SampleBlock) -> None:
        self._token.close()
        with self.lock:
            self._stores = [*self._stores[-1:], RingStore(head, self._capacity)]
        self._token.declare(f"{head.boot}/{time.time_ns()}")

    def _answer(self, question: bytes) -> list[bytes]:
        ask = Ask.from_bytes(question)
        with self.lock:
            known = [store for store in self._stores if store.boot == ask.boot]
            reply = known[-1].reply(ask) if known else self._unknown(ask.boot)
        return [reply.to_bytes()]

    def _unknown(self, boot: int) -> RingReply[SampleBlock]:
        """The reply about a boot that is not here, with a sample of the previous boot."""
        hints = tuple(store.first() for store in self._stores[:-1])
        return RingReply(boot, UNKNOWN, hints)

    def close(self) -> None:
        """Stop serving and give up control."""
        self._token.close()
        self._close()
