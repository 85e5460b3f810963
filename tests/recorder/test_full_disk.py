"""A disk that is really full: one mebibyte of tmpfs in a mount namespace of our own."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import json, os, sys
from pathlib import Path
import numpy as np
from rigwatch.recorder.disk import DiskWatch
from rigwatch.wire.host import free_share
from rigwatch.recorder.store import Store
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.session import open_session, run_info

disk = Path(sys.argv[1])
ballast = disk / "ballast"
ballast.write_bytes(bytes(600_000))
store, watch = Store(disk / "s", run_info("b", 256.0, t_ns=1), segment=3600.0), DiskWatch()
told = []
for turn in range(400):
    if turn == 300:
        ballast.unlink()
    index = np.arange(turn * 100, turn * 100 + 100)
    values = np.random.default_rng(turn).normal(size=100)
    column = Column("voltage", "V", values, np.zeros(100, np.uint8))
    store.add(SampleBlock("rig", 7, int(index[0]), index * 3906, index * 3906250, (column,)))
    told += [event.code for event in store.flush(float(turn), turn)]
    told += [event.code for event in watch.update(free_share(disk), turn)]
told += [event.code for event in store.close(400.0, 400)]
session = open_session(disk / "s")
seqs = [n for b in session.samples() for n in range(b.seq, b.seq + len(b))]
print(json.dumps({
    "told": told, "whole": seqs == list(range(40_000)), "lost": len(session.lost),
    "segments": len(session.segments), "dropped": store.dropped_samples,
}))
"""


def in_small_disk(folder: Path, script: str) -> "subprocess.CompletedProcess[str]":
    mount = f"mount -t tmpfs -o size=1m none {folder} && exec {sys.executable} - {folder}"
    return subprocess.run(
        ["unshare", "-Urm", "sh", "-c", mount],
        input=script,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


STARTING = """
import json, sys
from pathlib import Path
from monitor.alarms import AlarmJournal, AlarmManager, Occasion
from rigwatch.recorder.process import Recorder
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import HEALTH
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import run_info
from rigwatch.wire.typed_files import parse

disk = Path(sys.argv[1])
try:
    with (disk / "ballast").open("wb", buffering=0) as ballast:
        while ballast.write(bytes(4096)):
            pass
except OSError:
    pass
text = '[rig]\\nid="b"\\n[[channels]]\\nname="v"\\nunit="V"\\ngain=1.0\\n[daq.device]\\n'
text += 'adapter="serial"\\nport="/dev/null"\\n[recorder]\\nfolder="%s"\\n' % (disk / "s")
network = MemoryNetwork()
heard = network.bus("b", "observer").subscribe(HEALTH)
config = parse(text, RigConfig, "rig.toml")
recorder = Recorder(config, run_info("b", 256.0, t_ns=1), network.bus("b", "recorder"))
journal, alarms = AlarmJournal(disk / "alarms.jsonl"), AlarmManager()
alarms.report("disk", Occasion(), active=True)
journal.write(alarms.take_changes())
failed = journal.failure
for turn in range(3):
    recorder.turn(float(turn), turn)
states = [health.state for health in heard.drain()]
(disk / "ballast").unlink()
journal.write([])
recorder.turn(4.0, 4)
states += [health.state for health in heard.drain()]
print(json.dumps({"states": states, "failed": failed, "after": journal.failure}))
"""


def test_recorder_and_journal_start_on_a_full_disk_and_write_once_there_is_room(
    tmp_path: Path,
) -> None:
    if shutil.which("unshare") is None or in_small_disk(tmp_path, "").returncode:
        pytest.skip("no mount namespaces for users here")
    done = in_small_disk(tmp_path, STARTING)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["states"][-2:] == ["not recording", "recording"]
    assert "cannot be written" in found["failed"]
    assert found["after"] == ""


def test_recording_goes_on_when_a_full_disk_has_room_again(tmp_path: Path) -> None:
    if shutil.which("unshare") is None or in_small_disk(tmp_path, "").returncode:
        pytest.skip(
            "no mount namespaces for users here; test_store.py limits the file size instead"
        )
    done = in_small_disk(tmp_path, SCRIPT)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["told"] == [
        "DISK_NEARLY_FULL",
        "DISK_ALMOST_FULL",
        "RECORDING_STOPPED",
        "RECORDING_RESUMED",
        "DISK_ROOM",
    ]
    assert found["whole"]
    assert (found["lost"], found["dropped"]) == (0, 0)
    assert found["segments"] >= 2


READ_ONLY = """
import json, subprocess, sys
from pathlib import Path
from monitor.alarms import AlarmJournal, AlarmManager, Occasion, read_journal
from monitor.process.cursor import Cursor

disk = Path(sys.argv[1])
journal, alarms = AlarmJournal(disk / "alarms.jsonl"), AlarmManager()
alarms.report("daq", Occasion(), active=True)
journal.write(alarms.take_changes())
before = Cursor(disk / "position")
before.write(7, 11)
for one in (journal, before):
    one.close()

subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
journal, cursor = AlarmJournal(disk / "alarms.jsonl"), Cursor(disk / "position")
restored = [one.alarm.name for one in journal.newest()]
alarms.report("disk", Occasion(), active=True)
journal.write(alarms.take_changes())
failed, position = journal.failure, cursor.read()
cursor.write(7, 12)

subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
journal.write(())
cursor.keep()
kept = [one.alarm.name for one in read_journal(disk / "alarms.jsonl")[0]]
again = Cursor(disk / "position").read()
print(json.dumps([restored, failed, position, journal.failure, kept, again]))
"""


def test_a_monitor_starts_on_a_disk_that_has_become_read_only(tmp_path: Path) -> None:
    if shutil.which("unshare") is None or in_small_disk(tmp_path, "").returncode:
        pytest.skip("no mount namespaces for users here")
    done = in_small_disk(tmp_path, READ_ONLY)
    assert done.returncode == 0, done.stderr
    restored, failed, position, failure, kept, again = json.loads(done.stdout)
    assert restored == ["daq"]
    assert position == [7, 11]
    assert "the disk is read-only" in failed
    assert failure == ""
    assert kept == ["daq", "disk"]
    assert again == [7, 12]
