"""Several rigs in one recorder process; those of one disk take turns (`disk_turns`).

Each rig begins and ends in a thread of its own: a session that takes long to go on with delays no
other, and a disk that hangs delays those of no other disk.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from rigwatch.recorder.disk_turns import DiskTurns
from rigwatch.recorder.feed import Feed
from rigwatch.recorder.process import (
    FLUSH,
    PROCESS,
    FeedOf,
    describe_run,
    process_name,
    record,
)
from rigwatch.wire.bus import SharedLinks, joined
from rigwatch.wire.host import (
    Heartbeat,
    Part,
    RigPulse,
    Work,
    keep_memory_tidy,
    run_side_by_side,
    set_at_hangup,
    use_few_pools,
)
from rigwatch.wire.rig_config import load_rig, rig_text
from rigwatch.wire.several_rigs import valid_rigs

MANY = 32
"""Rigs from which on blocks are read by a compiled call: the compiler takes 130 MB once."""
FLUSH_OF_MANY = 0.9
"""Time until what was received is on the disk, if the configuration of so many says nothing [s].

Most of their cost is each rig's turns, of which there are then about half as many.
"""
BEGIN_TOGETHER = 4
"""Recordings that begin at the same time."""
BEGIN_PATIENCE = 10.0
"""Longest wait for one of those that begin to have begun [s]."""


class Begins:
    """Lets few recordings begin at a time, so that the first ones record while others wait.

    Hundreds that begin at once all ask the rings for what they have; none of them records before
    nearly all have begun, and what they miss meanwhile is still more to ask for. Recordings that do
    not get on, because their disk or their router hangs, do not hold the others up for long.
    """

    def __init__(self) -> None:
        self._free, self._begun = threading.Semaphore(BEGIN_TOGETHER), 0

    @contextmanager
    def one(self) -> Iterator[None]:
        """While a recording begins."""
        is_mine = self._may_begin()
        try:
            yield
        finally:
            self._begun += 1
            if is_mine:
                self._free.release()

    def _may_begin(self) -> bool:
        """Wait for its turn; false where the others do not get on."""
        before = -1
        while not self._free.acquire(timeout=BEGIN_PATIENCE):
            if self._begun == before:
                return False
            before = self._begun
        return True


@dataclass(frozen=True, eq=False)
class _Process:
    """What the recordings of a process share.

    Attributes:
        notes: for their descriptions.
        links: to routers.
        disks: their turns.
        flush: time until what was received is on the disk, if a configuration says nothing [s].
        begins: which may begin.
        folders: of the last session of each, written at its end.
    """

    notes: str
    links: SharedLinks
    disks: DiskTurns
    flush: float
    begins: Begins = field(default_factory=Begins)
    folders: dict[Path, Path] = field(default_factory=dict)


def work_of(path: Path, feed_of: FeedOf, process: _Process) -> Work:
    """The recording of one rig."""

    def work(stop: threading.Event, pulse: RigPulse) -> None:
        config = load_rig(path)
        with joined(config, process_name(config), stop, pulse.say, process.links) as bus:
            if bus is not None:
                run = describe_run(path, config, process.notes)
                process.folders[path] = record(
                    config,
                    run,
                    bus,
                    stop,
                    pulse,
                    disks=process.disks,
                    feed_of=feed_of,
                    flush=process.flush,
                    begins=process.begins.one(),
                )

    return work


def used(path: Path) -> str:
    """What the recording of a rig depends on: every key, as its session carries them."""
    load_rig(path)
    return rig_text(path)


def run_several(paths: list[Path], stop: threading.Event, notes: str = "") -> list[Path]:
    """Record the rigs at `paths` until `stop` is set; the folders of the last sessions.

    Raises:
        ConfigError: no configuration is valid, or two are of one rig.
    """
    use_few_pools()
    feeds = _feeds(len(paths))
    valid_rigs(paths)  # a wrong file is named by its rig's thread
    keep_memory_tidy(stop)
    links = SharedLinks(len(paths))
    flush = FLUSH if len(paths) < MANY else FLUSH_OF_MANY
    process = _Process(notes, links, DiskTurns(links.together, links.collect), flush)
    parts = [
        Part(str(path), work_of(path, feed, process), partial(used, path))
        for path, feed in zip(paths, feeds, strict=True)
    ]
    run_side_by_side(parts, Heartbeat(PROCESS), stop, set_at_hangup())
    links.close()
    return [process.folders[path] for path in paths if path in process.folders]


def _feeds(rigs: int) -> list[FeedOf]:
    """What makes the feed of each rig of a process."""
    if rigs < MANY:
        return [Feed] * rigs
    from rigwatch.recorder.row_feed import RowFeed, Rows  # with the compiler
    from rigwatch.wire.quick_joining import join_quickly

    join_quickly()
    rows = Rows(rigs)
    return [partial(RowFeed, rows, number) for number in range(rigs)]
