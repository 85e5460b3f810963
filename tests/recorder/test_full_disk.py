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
from rigwatch.recorder.disk import DiskWatch, free_share
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
