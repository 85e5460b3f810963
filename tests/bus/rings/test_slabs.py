"""Pieces in slabs: each stays as it is until it is dropped, in memory that stays what it is."""

import random
import tracemalloc
from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.bus.slabs import SLAB, Slabs


@given(st.lists(st.tuples(st.integers(0, SLAB + 9), st.integers(0, 3)), max_size=40))
def test_a_piece_is_unchanged_until_it_is_dropped(plan: list[tuple[int, int]]) -> None:
    slabs, stored = Slabs(), deque[tuple[memoryview, bytes]]()
    for number, (size, dropped) in enumerate(plan):
        piece = bytes([number]) * size
        stored.append((slabs.put(piece), piece))
        for _ in range(min(dropped, len(stored))):
            slabs.drop_oldest()
            stored.popleft()
        assert all(place == piece for place, piece in stored)


def test_memory_is_flat_once_all_room_is_taken() -> None:
    slabs, draw, stored, longest = Slabs(), random.Random(4), 0, 60_000
    sizes = deque[int]()
    most = 20 * SLAB / (1 - longest / SLAB) + 2 * SLAB  # the end of each slab may stay empty

    def run(pieces: int) -> int:
        nonlocal stored
        for _ in range(pieces):
            sizes.append(draw.randrange(2000, longest))
            slabs.put(bytes(sizes[-1]))
            stored += sizes[-1]
            while stored > 20 * SLAB:
                stored -= sizes.popleft()
                slabs.drop_oldest()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        assert 20 * SLAB < run(2000) < most
        assert run(20_000) < most
    finally:
        tracemalloc.stop()


def test_room_that_was_needed_once_is_given_back() -> None:
    slabs = Slabs()
    tracemalloc.start()
    try:
        slabs.put(b"one")
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(40):
            slabs.put(bytes(SLAB // 2))
        assert tracemalloc.get_traced_memory()[0] - before > 19 * SLAB
        for _ in range(40):
            slabs.drop_oldest()
        assert tracemalloc.get_traced_memory()[0] - before < 3 * SLAB
    finally:
        tracemalloc.stop()
