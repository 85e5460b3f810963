"""Takes the blocks of many rigs together; which ones, is decided here.

A rig's block is taken with those of others if

    the rig is on a serial line that is open and in order, and a block of its boot is in its ring;
    whole frames have come, all intact and of that boot, whose samples are the next ones.

Otherwise nothing of it is taken, and the rig's own chain reads it from the adapter, which keeps it.
"""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from daq.adapters import most_frames
from daq.chain import Chain
from daq.clock import DeviceClock
from daq.conditioning import Conditioner
from daq.sequence import SequenceTracker
from daq.together.message_text import MessageTexts, Text
from daq.together.seat import RigState, Seat, seat_of
from daq.together.tables import Blocks, blocks_for, keep_and_write, number_and_stamp
from rigwatch.wire.delivery import RingArrays
from rigwatch.wire.messages import ByteArray


@dataclass(frozen=True, slots=True)
class _Reading:
    """What a rig's line has brought: whole frames, and when the last byte arrived [ns]."""

    seat: Seat
    frames: bytes
    arrived_ns: int


class Lane:
    """The tables of a process."""

    def __init__(self) -> None:
        self._texts = MessageTexts()
        _compile()

    def take(self, chains: Sequence[Chain]) -> None:
        """Read the rigs' lines, and publish what can be taken together.

        Each rig's next `step` reads and publishes the rest, and raises what went wrong with it.
        """
        groups: dict[tuple[str, int], list[_Reading]] = {}
        for chain in chains:
            try:
                reading = _reading(chain)
            except Exception as error:  # the others are read
                chain.failure = error
                continue
            if reading is not None:
                groups.setdefault(reading.seat.alike, []).append(reading)
        for alike in groups.values():
            _take(alike, self._texts)


def _reading(chain: Chain) -> _Reading | None:
    """Read the line of a rig whose block may be taken."""
    seat = chain.seat
    if not (isinstance(seat, Seat) and seat.lasts):
        chain.seat = seat = seat_of(chain)
    if seat is None or not chain.device.connected or chain.device.text:
        return None
    found = chain.device.attempt(seat.adapter.receive)
    return None if found is None else _Reading(seat, *found)


def _take(alike: Sequence[_Reading], known: MessageTexts) -> None:
    """Publish the blocks of rigs with as many channels that simply follow."""
    seats = [reading.seat for reading in alike]
    sizes = [len(reading.frames) for reading in alike]
    channels = seats[0].adapter.channels
    blocks = blocks_for(len(seats), most_frames(max(sizes), channels), channels)
    like, rigs = seats[0].state.state, np.array([seat.state.address for seat in seats])
    number_and_stamp(
        like,
        rigs,
        np.frombuffer(b"".join([reading.frames for reading in alike]), np.uint8),
        np.array([0, *accumulate(sizes)]),
        np.array([reading.arrived_ns for reading in alike]),
        np.array([seat.longest for seat in seats]),
        blocks,
    )
    counts: list[int] = blocks.size.tolist()
    taken = [row for row, count in enumerate(counts) if count]
    if not taken:
        return
    _stamp_rest(seats, taken, blocks)
    firsts = blocks.samples[:, 0, 0].tolist()
    texts = [known.of(seats[row].store, firsts[row], counts[row]) for row in taken]
    starts = [0, *accumulate([text.size for text in texts])]
    to = np.empty(starts[-1], np.uint8)
    with _all_held([seats[row].chain.publisher.ring.lock for row in taken]):
        keep_and_write(
            like,
            rigs,
            texts[0].state.state,
            np.array([text.state.address for text in texts]),
            np.array(taken),
            np.array(starts),
            blocks,
            to,
        )
        for row in taken:
            seats[row].store.newest = firsts[row] + counts[row] - 1
    written, stamps = to.tobytes(), blocks.stamps[taken, blocks.size[taken] - 1].tolist()
    for row, begin, end, last_ns in zip(taken, starts[:-1], starts[1:], stamps, strict=True):
        if blocks.flagged[row]:
            _count_flags(seats[row], blocks.flags[row, : counts[row]])
        try:
            _publish(alike[row], counts[row], last_ns, written[begin:end])
        except Exception as error:  # the others' are published
            seats[row].chain.failure = error


def _stamp_rest(seats: Sequence[Seat], taken: Sequence[int], blocks: Blocks) -> None:
    """Stamp what lies along no line: as each quarter second begins, and after a jump."""
    for row in np.array(taken)[(blocks.stamped < blocks.size)[taken]].tolist():
        of, count = seats[row].chain.acquisition, int(blocks.size[row])
        samples = blocks.samples[row, :, :count]
        at, stamps = int(blocks.stamped[row]), blocks.stamps[row, :count]
        if jump := of.clock.stamp_rest(samples, at, stamps):
            remark = of.clock_jumped(jump, int(samples[2, 0]))
            seats[row].chain.publisher.publish([remark])


def _count_flags(seat: Seat, flags: ByteArray) -> None:
    for name, of_channel in zip(seat.channels, flags.T, strict=True):
        seat.chain.acquisition.watch.count_flags(name, of_channel)


def _publish(reading: _Reading, count: int, last_ns: int, payload: bytes) -> None:
    """Publish a block of so many samples, which are in the ring, the last one of this time [ns]."""
    seat, of = reading.seat, reading.seat.chain.acquisition
    last_ns -= of.clock.unix_ns(0)
    of.samples += count
    of.watch.saw_run(seat.store.boot, seat.store.newest, count, last_ns, reading.arrived_ns)
    seat.adapter.took(count)
    seat.chain.publisher.publish_kept(payload)
    seat.chain.taken = True


@contextmanager
def _all_held(locks: Sequence[threading.Lock]) -> Iterator[None]:
    """While all are held; others hold one at a time."""
    for lock in locks:
        lock.acquire()
    try:
        yield
    finally:
        for lock in locks:
            lock.release()


def _compile() -> None:
    """Compile before the first sample arrives."""
    nothing, bytes_ = np.zeros(0, np.int64), np.zeros(0, np.uint8)
    clock, times = DeviceClock(1.0), np.zeros(1, np.int64)
    rows = np.zeros((1, 1)), np.zeros((1, 1), np.uint8)
    like = RigState(
        SequenceTracker(1.0).count,
        clock.place,
        clock.line,
        Conditioner(()).states,
        RingArrays(times, times, times, *rows),
    )
    blocks, starts = blocks_for(1, 1, 1), np.zeros(1, np.int64)
    data = np.frombuffer(b"", np.uint8)
    number_and_stamp(like, nothing, data, starts, nothing, nothing, blocks)
    text = Text(bytes_, nothing)
    keep_and_write(like, nothing, text, nothing, nothing, starts, blocks, bytes_)
