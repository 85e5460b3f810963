"""Rigs whose sessions are on one disk take turns; those of another disk never wait for it.

    rigs of a disk ──begin──▶ files ──sync, side by side──▶ on the disk ──end──▶ health, positions

A thread for each rig spends most of its time on waiting for the interpreter. Syncs at the same time
cost the disk little more than one: 300 take as long as three, one after the other.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Protocol

from rigwatch.wire.host import Turns

PART = 50
"""Rigs in a part of a turn, at least, if there are so many."""
MOST_SYNCS = 16
"""Files of a disk that are synced at the same time: to hand one to a thread costs as much as a
small sync."""
Together = Callable[[], AbstractContextManager[object]]
Collect = Callable[[], None]


def _collect_nothing() -> None:
    """Each recording takes what is its own."""


class Turn(Protocol):
    """What is due of one recording; only `end` raises, also what was wrong before."""

    def begin(self) -> None:
        """Take what has come, and write it."""

    def sync(self) -> None:
        """Wait for the disk; called in another thread."""

    def end(self) -> None:
        """Tell what came of it, and see to the rest."""


def take_turns(turn: Turn, every: float, stop: threading.Event) -> None:
    """Take a turn every so often [s] until `stop` is set."""
    while not stop.wait(every):
        turn.begin()
        turn.sync()
        turn.end()


class DiskTurns:
    """The turns of a process's recordings, apart for each disk.

    Args:
        together: entered for each part of a turn, so that what it sends leaves together.
        collect: called before each part: takes what has come for several recordings.
    """

    def __init__(
        self, together: Together = nullcontext, collect: Collect = _collect_nothing
    ) -> None:
        self._together, self._collect = together, collect
        self._turns: dict[tuple[int, float], Turns] = {}
        self._lock = threading.Lock()

    def serve(self, turn: Turn, folder: Path, every: float, stop: threading.Event) -> None:
        """Take turns with the recordings on the same disk until `stop` is set, or one fails.

        Args:
            turn: of the recording.
            folder: where it is written.
            every: time between two turns [s].
            stop: ends it.
        """

        def step() -> bool:
            turn.end()
            return not stop.is_set()

        self._of(_disk(folder), every).serve(step, turn)

    def _of(self, disk: int, every: float) -> Turns:
        with self._lock:
            if (disk, every) not in self._turns:
                syncs = ThreadPoolExecutor(MOST_SYNCS, "sync")
                before = partial(_begin_all, self._collect, syncs)
                self._turns[disk, every] = Turns(every, self._together, before=before, part=PART)
            return self._turns[disk, every]


def _begin_all(collect: Collect, syncs: Executor, turns: Sequence[Turn]) -> None:
    collect()
    for turn in turns:
        turn.begin()
    groups = min(len(turns), MOST_SYNCS)
    wait([syncs.submit(_sync_all, turns[first::groups]) for first in range(groups)])


def _sync_all(turns: Sequence[Turn]) -> None:
    for turn in turns:
        turn.sync()


def _disk(folder: Path) -> int:
    """The number of the disk that a folder is on, or will be on once it is made."""
    for place in (folder, *folder.parents):
        with suppress(OSError):
            return place.stat().st_dev
    return 0
