"""A rig's recording and journal are kept by one process; a second, started by hand, is refused."""

import errno
import fcntl
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from monitor.process.loop import _opened
from rigwatch.recorder.process import describe_run, record
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import HeldError, SessionError
from rigwatch.wire.host import Heartbeat, Hold, Kept
from tests.bus.rig import TestRig

KEEPER = """
import sys
from pathlib import Path
from rigwatch.wire.host import Kept
kept = Kept(Path(sys.argv[1]), "it")
print("holds it", flush=True)
sys.stdin.read()
"""


@contextmanager
def keeper(path: Path) -> Iterator["subprocess.Popen[str]"]:
    """Another process that holds a lock, until it is killed."""
    with subprocess.Popen(
        [sys.executable, "-c", KEEPER, str(path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "holds it\n"
        yield process
        process.kill()


def test_a_second_recorder_of_a_rig_is_refused_until_the_first_has_ended(tmp_path: Path) -> None:
    root = tmp_path / "sessions"
    rig = TestRig(tmp_path, f'\n[recorder]\nfolder = "{root}"\n')
    bus, ended = MemoryNetwork().bus("bench", "recorder"), threading.Event()
    ended.set()

    def recorded() -> None:
        record(rig.config, describe_run(rig.path, rig.config), bus, ended, Heartbeat("recorder"))

    with (
        keeper(root / ".bench.lock") as first,
        pytest.raises(SessionError, match=f"recording of bench: process {first.pid} keeps it"),
    ):
        recorded()
    assert not list(root.glob("bench-*"))
    recorded()
    with keeper(root / ".bench.lock"):  # it was given up
        pass


def test_a_second_monitor_on_a_journal_is_refused_until_the_first_has_ended(tmp_path: Path) -> None:
    journal = tmp_path / "alarms.jsonl"
    with (
        keeper(tmp_path / "alarms.jsonl.lock") as first,
        pytest.raises(SessionError, match=f"alarm journal: process {first.pid} keeps it already"),
    ):
        _opened(str(journal))
    alone, kept, cursor, said = _opened(str(journal))
    assert alone is not None
    assert kept is not None
    assert cursor is not None
    assert said is not None
    said.close()
    kept.close()
    cursor.close()
    alone.give_up()
    with keeper(tmp_path / "alarms.jsonl.lock"):
        pass


def test_a_lock_whose_file_somebody_removes_is_taken_again(tmp_path: Path) -> None:
    lock = tmp_path / "sessions" / ".bench.lock"
    kept = Kept(lock, "recording of bench")
    lock.unlink()
    lock.parent.rmdir()
    kept.check()
    with subprocess.Popen(
        [sys.executable, "-c", KEEPER, str(lock)], stderr=subprocess.PIPE, text=True
    ) as second:
        assert f"process {os.getpid()} keeps it already" in second.communicate()[1]
    lock.unlink()
    with keeper(lock) as other, pytest.raises(SessionError, match=f"process {other.pid} keeps"):
        kept.check()
    kept.check()


def test_within_a_process_a_lock_is_held_once(tmp_path: Path) -> None:
    first, second = Hold(tmp_path / "lock"), Hold(tmp_path / "lock")
    first.take()
    with pytest.raises(HeldError, match=f"process {os.getpid()}"):
        second.take()
    with pytest.raises(AssertionError), keeper(tmp_path / "lock"):
        pass  # the refusal has not freed it
    first.give_up()
    second.take()


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_where_no_lock_can_be_had_it_is_said_once_and_the_work_goes_on(
    number: int, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "lockf", refused)
    kept = Kept(tmp_path / "lock", "it")
    kept.check()
    kept.give_up()
    (said,) = caplog.messages
    assert "a second process that keeps the same would not be noticed" in said


def test_a_lock_that_a_full_disk_refuses_is_said_once_and_taken_when_there_is_space(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "full")

    with monkeypatch.context() as disk:
        disk.setattr(os, "open", full)
        kept = Kept(tmp_path / "lock", "it")
        kept.check()
    (said,) = caplog.messages
    assert "no lock can be had: no space left on the disk" in said
    kept.check()
    with pytest.raises(AssertionError), keeper(tmp_path / "lock"):
        pass
