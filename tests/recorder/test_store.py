"""The recorder's store against a disk that fills up, is missing, and comes back."""

import errno
import os
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest

from rigwatch.recorder.disk import DiskWatch
from rigwatch.recorder.store import Store
from rigwatch.wire.host import free_share
from rigwatch.wire.messages.message_types import Column, Event, Health, SampleBlock
from rigwatch.wire.session import open_session, run_info
from tests.recorder.full_disk import largest_file

RUN = run_info("bench1", 256.0, t_ns=1)


def block(seq: int, n: int = 8) -> SampleBlock:
    index = np.arange(seq, seq + n)
    values = np.random.default_rng(seq).normal(size=n)
    column = Column("voltage", "V", values, np.zeros(n, np.uint8))
    return SampleBlock("rig", 7, seq, index * 3906, index * 3906250, (column,))


def recorded(folder: Path) -> list[int]:
    """Sequence numbers in the session, in order."""
    session = open_session(folder)
    found = list(session.samples())
    assert session.lost == ()
    return [seq for b in found for seq in range(b.seq, b.seq + len(b))]


def codes(events: list[Event]) -> list[str]:
    return [event.code for event in events]


def test_segments_follow_each_other_without_a_seam(tmp_path: Path) -> None:
    store = Store(tmp_path / "s", RUN, segment=10.0)
    for turn in range(60):
        store.add(block(turn * 8))
        store.flush(turn * 0.5, 0)
    store.close(29.9, 0)
    names = [path.name for path in sorted((tmp_path / "s").iterdir())]
    assert names == ["000001.mcap", "000002.mcap", "000003.mcap"]
    assert recorded(tmp_path / "s") == list(range(480))
    assert [open_session(tmp_path / "s" / name).info for name in names] == [RUN] * 3
    assert open_session(tmp_path / "s").unclosed == ()


def test_a_disk_that_fails_while_it_is_waited_for_costs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path / "s", RUN, segment=3600.0)
    store.add(block(0))
    assert store.flush(0.0, 0) == []
    size = (tmp_path / "s" / "000001.mcap").stat().st_size

    def fails(_descriptor: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    store.add(block(8))
    store.send(1.0)
    store.send(1.0)  # written once
    assert (tmp_path / "s" / "000001.mcap").stat().st_size > size
    with monkeypatch.context() as disk:
        disk.setattr(os, "fsync", fails)
        waits = threading.Thread(target=store.sync)
        waits.start()
        waits.join()
    assert codes(store.settle(1.0, 0)) == ["RECORDING_STOPPED"]
    assert "input/output error" in store.failure
    assert (store.samples, (tmp_path / "s" / "000001.mcap").stat().st_size) == (8, size)
    assert codes(store.flush(2.0, 0)) == ["RECORDING_RESUMED"]
    store.close(3.0, 0)
    assert (recorded(tmp_path / "s"), store.samples) == (list(range(16)), 16)


def test_a_full_disk_costs_nothing_while_memory_lasts(tmp_path: Path) -> None:
    store = Store(tmp_path / "s", RUN, segment=3600.0)
    store.add(block(0))
    assert store.flush(0.0, 0) == []
    told: list[Event] = []
    with largest_file(1 << 10):
        for turn in range(1, 20):
            store.add(block(turn * 8))
            told += store.flush(turn * 0.5, turn)
    assert codes(told) == ["RECORDING_STOPPED"]
    assert "cannot be written" in told[0].text
    assert store.failure
    store.add(block(160))
    assert codes(store.flush(20.0, 0)) == ["RECORDING_RESUMED"]
    store.close(20.5, 0)
    assert store.failure == ""
    assert store.dropped_samples == 0
    assert recorded(tmp_path / "s") == list(range(168))
    assert len(open_session(tmp_path / "s").segments) >= 2


def test_a_folder_that_somebody_removes_is_told_and_recording_goes_on_in_a_new_one(
    tmp_path: Path,
) -> None:
    store = Store(tmp_path / "s", RUN, segment=3600.0)
    store.add(block(0))
    store.flush(0.0, 0)
    shutil.rmtree(tmp_path / "s")
    store.add(block(8))
    (told,) = store.flush(0.5, 0)
    assert (told.code, "it has been removed" in told.text) == ("RECORDING_STOPPED", True)
    store.add(block(16))
    assert codes(store.flush(1.5, 0)) == ["RECORDING_RESUMED"]
    store.close(2.0, 0)
    assert recorded(tmp_path / "s") == list(range(8, 24))


def test_what_memory_cannot_hold_is_dropped_and_counted(tmp_path: Path) -> None:
    store = Store(tmp_path / "s", RUN, segment=3600.0, ram_bytes=20_000)
    for turn in range(100):
        store.add(block(turn * 8))
        with largest_file(0):
            store.flush(turn * 1.0, turn)
    told = store.flush(101.0, 0)
    store.close(101.0, 0)
    seqs = recorded(tmp_path / "s")
    assert seqs[-1] == 799
    assert len(seqs) + store.dropped_samples == 800
    assert store.dropped_samples > 0
    assert f"{store.dropped_samples} messages or samples lost" in told[0].text
    assert store.samples == len(seqs)


def test_long_texts_weigh_what_they_are(tmp_path: Path) -> None:
    ram = 1 << 20
    store = Store(tmp_path / "s", RUN, segment=3600.0, ram_bytes=ram)
    with largest_file(0):
        for turn in range(100):
            store.add(Event("eve", turn, "info", "X", "x" * 100_000))
            store.add(Health("eve", turn, "y" * 100_000, "", {}))
            store.flush(turn * 1.0, turn)
    assert sum(len(getattr(one, "text", "")) for one in store._waiting) <= ram
    assert store.dropped_messages > 150


def test_a_folder_that_cannot_be_made_is_tried_again(tmp_path: Path) -> None:
    (tmp_path / "s").write_text("in the way")
    store = Store(tmp_path / "s" / "run", RUN, segment=3600.0)
    store.add(block(0))
    (event,) = store.flush(0.0, 0)
    assert "cannot be made" in event.text
    (tmp_path / "s").unlink()
    assert store.flush(0.5, 0) == []
    assert codes(store.flush(1.0, 0)) == ["RECORDING_RESUMED"]
    store.close(1.5, 0)
    assert recorded(tmp_path / "s" / "run") == list(range(8))


def test_a_store_that_never_gets_a_disk_says_what_it_lost(tmp_path: Path) -> None:
    (tmp_path / "s").write_text("in the way")
    store = Store(tmp_path / "s" / "run", RUN, segment=3600.0)
    store.add(block(0))
    store.add(Health("daq", 0, "running", "", {}))
    assert codes(store.close(0.0, 0)) == ["RECORDING_STOPPED"]
    assert (store.dropped_samples, store.dropped_messages) == (8, 1)


def test_segments_of_an_earlier_run_are_left_alone(tmp_path: Path) -> None:
    for start in (0, 8):
        store = Store(tmp_path / "s", RUN, segment=3600.0)
        store.add(block(start))
        store.close(0.0, 0)
    assert recorded(tmp_path / "s") == list(range(16))


def test_the_disk_is_announced_once_a_level() -> None:
    watch = DiskWatch()
    shares = [0.5, 0.09, 0.08, 0.019, 0.01, 0.05, float("nan"), 0.3]
    told = [codes(watch.update(share, 0)) for share in shares]
    assert told == [
        [],
        ["DISK_NEARLY_FULL"],
        [],
        ["DISK_ALMOST_FULL"],
        [],
        [],
        [],
        ["DISK_ROOM"],
    ]


def test_free_share_of_a_folder_that_is_not_there_yet(tmp_path: Path) -> None:
    assert free_share(tmp_path / "a" / "b") == pytest.approx(free_share(tmp_path), abs=0.01)
    assert 0 <= free_share(tmp_path) <= 1
