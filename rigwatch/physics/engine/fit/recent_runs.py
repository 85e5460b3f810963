"""Recent runs of effect states, found again by their equations, signals and parameters.

Every model that is scored or fitted simulates the states of the same effects along the same
measured signals; a run that was made before is not made again.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from threading import Lock

from rigwatch.wire.arrays import FloatArray

MOST = 32_000_000
"""Largest number of bytes of all runs kept."""


class RecentRuns:
    """Runs by key, the most recent ones only."""

    def __init__(self) -> None:
        self._size, self._lock = 0, Lock()
        self._kept: OrderedDict[tuple[object, ...], FloatArray] = OrderedDict()

    def get(self, key: tuple[object, ...], make: Callable[[], FloatArray]) -> FloatArray:
        """The run of a key, read-only; made if it is not kept."""
        with self._lock:
            found = self._kept.get(key)
            if found is not None:
                self._kept.move_to_end(key)
                return found
        made = make()
        made.setflags(write=False)
        with self._lock:
            if key not in self._kept:
                self._kept[key] = made
                self._size += made.nbytes
            while self._size > MOST:
                self._size -= self._kept.popitem(last=False)[1].nbytes
        return made


def digest(signals: FloatArray) -> bytes:
    """What tells signals apart, of any size."""
    return hashlib.blake2b(signals.tobytes(), digest_size=20).digest()
