"""Recordings on one disk take turns; another disk, and one that fails, delay nothing of them."""

import threading
from pathlib import Path

import pytest

from rigwatch.recorder.disk_turns import DiskTurns, Turn
from rigwatch.recorder.process import FLUSH, describe_run, record
from rigwatch.recorder.several import FLUSH_OF_MANY
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.host import Heartbeat
from tests.bus.rig import TestRig
from tests.waiting import PATIENCE, eventually

EVERY = 0.005
OTHER_DISK = Path("/dev/shm")


class Recording:
    """The turns of one recording, in a thread of its own as in a process of several rigs."""

    def __init__(self, disks: DiskTurns, folder: Path) -> None:
        self.turns, self.threads, self.error = 0, set[int](), ""
        self.fails_in, self.disk_answers = "", threading.Event()
        self.syncing = threading.Event()
        self.disk_answers.set()
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self._run, args=[disks, folder], daemon=True)
        self.thread.start()

    def _run(self, disks: DiskTurns, folder: Path) -> None:
        try:
            disks.serve(self, folder, EVERY, self.stop)
        except OSError as error:
            self.error = str(error)

    def begin(self) -> None:
        self.threads.add(threading.get_ident())

    def sync(self) -> None:
        self.syncing.set()
        self.disk_answers.wait(PATIENCE)
        self.syncing.clear()

    def end(self) -> None:
        self.turns += 1
        if self.fails_in == "end":
            raise OSError("no position")

    def finish(self) -> None:
        self.stop.set()
        self.thread.join(PATIENCE)
        assert not self.thread.is_alive()


def go_on(*recordings: Recording) -> None:
    before = [one.turns for one in recordings]
    eventually(
        lambda: all(one.turns > b + 5 for one, b in zip(recordings, before, strict=True)), "turns"
    )


def test_recordings_of_one_disk_take_turns_in_one_thread_and_each_ends_alone(
    tmp_path: Path,
) -> None:
    disks = DiskTurns()
    one, other, third = (Recording(disks, tmp_path / "not made yet") for _ in range(3))
    go_on(one, other, third)
    assert len(one.threads | other.threads | third.threads) == 1
    third.fails_in = "end"
    third.thread.join(PATIENCE)
    assert third.error == "no position"
    go_on(one, other)
    one.finish()
    go_on(other)
    other.finish()


def test_files_of_one_disk_are_synced_at_the_same_time(tmp_path: Path) -> None:
    disks = DiskTurns()
    recordings = [Recording(disks, tmp_path) for _ in range(4)]
    go_on(*recordings)
    for one in recordings:
        one.disk_answers.clear()
    eventually(lambda: all(one.syncing.is_set() for one in recordings), "all syncs at once")
    for one in recordings:
        one.disk_answers.set()
    go_on(*recordings)
    for one in recordings:
        one.finish()


def test_a_disk_that_hangs_delays_no_recording_on_another(tmp_path: Path) -> None:
    if OTHER_DISK.stat().st_dev == tmp_path.stat().st_dev:
        pytest.skip("there is only one disk")
    disks = DiskTurns()
    here, there = Recording(disks, tmp_path), Recording(disks, OTHER_DISK)
    go_on(here, there)
    there.disk_answers.clear()
    eventually(there.syncing.is_set, "the disk hangs")
    stuck = there.turns
    go_on(here)
    assert there.turns == stuck
    there.disk_answers.set()
    go_on(here, there)
    here.finish()
    there.finish()


class Noted(DiskTurns):
    """Turns that note how often they are asked for."""

    def serve(self, turn: Turn, folder: Path, every: float, stop: threading.Event) -> None:
        self.every = every
        super().serve(turn, folder, every, stop)


@pytest.mark.parametrize(
    ("written", "flush", "every"),
    [("", FLUSH, 0.4), ("", FLUSH_OF_MANY, 0.72), ("flush = 0.1\n", FLUSH_OF_MANY, 0.08)],
    ids=["few", "many", "as the file says"],
)
def test_a_recording_among_many_is_flushed_less_often_unless_its_file_says(
    written: str, flush: float, every: float, tmp_path: Path
) -> None:
    rig = TestRig(tmp_path, f'\n[recorder]\nfolder = "{tmp_path / "sessions"}"\n{written}')
    bus, ended, turns = MemoryNetwork().bus("bench", "recorder"), threading.Event(), Noted()
    ended.set()
    run = describe_run(rig.path, rig.config)

    record(rig.config, run, bus, ended, Heartbeat("recorder"), disks=turns, flush=flush)

    assert turns.every == pytest.approx(every)
