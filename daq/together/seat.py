"""What the tables need of one rig, as its own objects hold it."""

from typing import NamedTuple

from daq.acquisition import LONGEST_BLOCK
from daq.adapters.serial_line import SerialAdapter
from daq.chain import Chain
from daq.conditioning import States
from daq.together.message_text import MessageText
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.delivery import RingArrays, RingStore
from rigwatch.wire.kept_state import KeptState

MOST_TEXTS = 24
"""Lengths of blocks whose texts are kept: a rig has few, unless its process was held up."""


class RigState(NamedTuple):
    """Arrays of a rig's tracker, clock, conditioner and ring, which compiled calls write to."""

    tracker: IntArray
    place: IntArray
    line: FloatArray
    channels: States
    ring: RingArrays


class Seat:
    """A rig at the tables, from one of its blocks on as long as it keeps its boot and its ring.

    Args:
        chain: the rig's.
        adapter: its line.
        store: the ring of its boot.

    Attributes:
        state: of its objects.
        alike: rigs for which it is the same are taken by the same calls.
        longest: most samples of a block.
        channels: their names.
    """

    def __init__(self, chain: Chain, adapter: SerialAdapter, store: RingStore) -> None:
        self.chain, self.adapter, self.store = chain, adapter, store
        of = chain.acquisition
        clock = of.clock
        self.state = KeptState(
            RigState(of.tracker.count, clock.place, clock.line, of.conditioner.states, store.arrays)
        )
        self.alike = self.state.kind, adapter.channels
        self.longest = min(of.longest, store.capacity, LONGEST_BLOCK)
        self.channels = [name for name, _, _ in store.layout]
        self._texts: dict[tuple[int, int], MessageText] = {}

    @property
    def lasts(self) -> bool:
        """Whether the rig still has the boot and the ring of this seat."""
        chain, boot = self.chain, self.store.boot
        of = chain.acquisition
        same = of.tracker.boot == boot == of.conditioner.boot
        return same and chain.publisher.ring.store_of(boot) is self.store

    def text(self, seq: int, count: int) -> MessageText:
        """Of a block of so many samples from `seq` on."""
        alike = count, seq.bit_length() // 7
        if alike not in self._texts:
            if len(self._texts) >= MOST_TEXTS:
                self._texts.clear()
            self._texts[alike] = MessageText(self.store.empty_block(seq, count))
        return self._texts[alike]


def seat_of(chain: Chain) -> Seat | None:
    """A seat for a rig on a serial line whose last block has come to its ring."""
    adapter, boot = chain.adapter, chain.acquisition.tracker.boot
    store = chain.publisher.ring.store_of(boot)
    if not isinstance(adapter, SerialAdapter) or store is None:
        return None
    seat = Seat(chain, adapter, store)
    return seat if seat.lasts and len(seat.channels) == adapter.channels else None
