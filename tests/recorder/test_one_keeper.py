"""A rig's recording and journal are kept by one process; a second, started by hand, is refused."""

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
from rigwatch.wire.errors import SessionError
from rigwatch.wire.host import Heartbeat
from tests.bus.rig import TestRig

KEEPER = """
import sys
from pathlib import Path
from rigwatch.wire.host import hold
kept = hold(Path(sys.argv[1]), "it")
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
    give_up, kept, cursor = _opened(str(journal))
    assert kept is not None
    assert cursor is not None
    kept.close()
    cursor.close()
    give_up()
    with keeper(tmp_path / "alarms.jsonl.lock"):
        pass
