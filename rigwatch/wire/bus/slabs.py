"""Room for pieces of bytes that come and go in one order, in slabs that are used again.

Pieces of ever new lengths that live for minutes leave holes in a process's memory, which grow over
months. In slabs of one size they leave none: a slab whose pieces are all gone takes the next ones.
One such slab waits; others are given back, or a process would keep the most that it ever needed.
"""

from collections import deque
from collections.abc import Sequence

SLAB = 1 << 18
"""Size of a slab [bytes]; a longer piece has one of its own, which is given back after it."""


class Slabs:
    """Pieces of bytes, the oldest of which is dropped first."""

    def __init__(self) -> None:
        self._filled: deque[bytearray] = deque()
        self._pieces: deque[int] = deque()  # in each of them
        self._free: bytearray | None = None
        self._used = 0  # of the newest [bytes]

    def put(self, piece: Sequence[int] | bytes) -> memoryview:
        """Store a piece: what is returned shows it until it is dropped."""
        if not self._filled or self._used + len(piece) > len(self._filled[-1]):
            self._filled.append(self._slab(len(piece)))
            self._pieces.append(0)
            self._used = 0
        end = self._used + len(piece)
        place = memoryview(self._filled[-1])[self._used : end]
        place[:] = bytes(piece)
        self._pieces[-1] += 1
        self._used = end
        return place.toreadonly()

    def _slab(self, size: int) -> bytearray:
        if size > SLAB:
            return bytearray(size)
        free, self._free = self._free, None
        return bytearray(SLAB) if free is None else free

    def drop_oldest(self) -> None:
        """Drop the oldest piece: what showed it must no longer be used."""
        self._pieces[0] -= 1
        if not self._pieces[0]:
            self._pieces.popleft()
            slab = self._filled.popleft()
            if len(slab) == SLAB and self._free is None:
                self._free = slab
