"""What the tables need of one rig, as its own objects hold it."""

from typing import NamedTuple

from daq.acquisition import LONGEST_BLOCK
from daq.adapters import SerialAdapter
from daq.chain import Chain
from daq.conditioning import States
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.delivery import RingArrays, RingStore
from rigwatch.wire.kept_state import KeptState


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
        self._ring = chain.publisher.ring
        of = chain.acquisition
        clock = of.clock
        self.state = KeptState(
            RigState(of.tracker.count, clock.place, clock.line, of.conditioner.states, store.arrays)
        )
        self.alike = self.state.kind, adapter.channels
        self.longest = min(of.longest, store.capacity, LONGEST_BLOCK)
        self.channels = [name for name, _, _ in store.layout]

    @property
    def lasts(self) -> bool:
        """Whether the rig still has the ring of this seat: each boot's first block begins one."""
        return self._ring.newest is self.store


def seat_of(chain: Chain) -> Seat | None:
    """A seat for a rig on a serial line whose last block has come to its ring."""
    adapter, store = chain.adapter, chain.publisher.ring.newest
    if not isinstance(adapter, SerialAdapter) or store is None:
        return None
    fits = store.boot > 0 and len(store.layout) == adapter.channels
    return Seat(chain, adapter, store) if fits else None
