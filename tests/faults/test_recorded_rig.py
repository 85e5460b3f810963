"""Faults of the recorder and its disk, with the recorder as a process on a running rig."""

import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.messages import SAMPLES
from rigwatch.wire.session import SessionWriter, open_session, run_info
from tests.bus.publisher import wave
from tests.bus.rig import ROOT, rigwatch
from tests.faults.field import RATE, Field, numbers
from tests.waiting import PATIENCE

pytestmark = pytest.mark.xdist_group("faults-supervised")
BOOT = 5
SIZE = 4 << 20


class RecordedRig(Field):
    """The rig, with the number of the newest sample that was published."""

    newest = -1

    def begin(self) -> None:
        self.start("monitor")
        samples = self.bus.subscribe_lossy(SAMPLES)
        self.beside(lambda stop: self._follow(samples, stop))
        self.rig.publisher(BOOT, "--wave")
        self.judged(BOOT, 64)

    def _follow(self, samples, stop) -> None:  # type: ignore[no-untyped-def]
        while not stop.wait(0.005):
            for block in samples.drain():
                self.newest = block.seq + len(block) - 1


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecordedRig]:
    folder = tmp_path_factory.mktemp("recorded")
    section = 'adapter = "serial"\nport = "/dev/null"'
    recorder = f'[recorder]\nfolder = "{folder}/sessions"\n'
    with RecordedRig(folder, section, extra=recorder) as made:
        made.begin()
        yield made


def recorded(folder: Path) -> list[int]:
    return numbers(list(open_session(folder).samples()), BOOT)


def test_47_a_damaged_session(tmp_path: Path) -> None:
    path = tmp_path / "whole.mcap"
    with SessionWriter(path, run_info("bench", RATE, t_ns=1)) as writer:
        for first in range(0, 2048, 128):
            writer.write(wave(first, 128, BOOT, 1))
            writer.flush()
    whole = path.read_bytes()
    broken, saved = tmp_path / "broken.mcap", tmp_path / "saved.mcap"
    damaged = bytearray(whole[: len(whole) // 2])
    damaged[len(damaged) // 2] ^= 1
    broken.write_bytes(damaged)
    told = rigwatch("info", str(broken))
    assert "lost" in told.stdout
    done = rigwatch("recover", str(broken), str(saved))
    assert done.returncode == 0, done.stderr
    kept = recorded(saved)
    assert kept == sorted(set(kept))
    assert 512 <= len(kept) < 1920, "sound chunks before and after the flipped bit"
    assert max(np.diff(kept)) > 1


def only_session(rig: Field) -> Path:
    (folder,) = (rig.folder / "sessions").glob("*Z*")
    return folder


def test_45_a_recorder_that_is_killed(rig: RecordedRig) -> None:
    began = time.time_ns()
    rig.start("record")
    rig.health_after("recorder", began + 2 * 10**9)
    newest = rig.newest
    rig.kill("record")
    kept = recorded(only_session(rig))
    assert kept == list(range(kept[0], kept[-1] + 1))
    assert newest - kept[-1] <= RATE, "a second at most"


class SmallDisk:
    """A shell with a disk of its own, of 4 MiB, on which the recorder runs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        script = f"mount -t tmpfs -o size={SIZE} none {folder} && exec sh"
        self.shell = subprocess.Popen(
            ["unshare", "-Urm", "sh", "-c", script],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip

    def run(self, line: str) -> str:
        """What a command prints, once it is done."""
        assert self.shell.stdin is not None
        assert self.shell.stdout is not None
        self.shell.stdin.write(f"{line}; echo done\n")
        self.shell.stdin.flush()
        said = ""
        while (found := self.shell.stdout.readline()) not in ("done\n", ""):
            said += found
        return said

    def fill(self, free: int) -> int:
        """Leave so many bytes free; the time at which that is so [ns]."""
        self.run(
            f"n=$(df -B1 --output=avail {self.folder} | tail -1); "
            f"head -c $((n - {free})) /dev/zero >> {self.folder}/ballast 2>/dev/null"
        )
        return time.time_ns()

    def close(self) -> None:
        assert self.shell.stdin is not None
        self.shell.stdin.close()
        self.shell.wait(PATIENCE)


@pytest.mark.nightly
def test_46_a_disk_that_fills(rig: RecordedRig, tmp_path: Path) -> None:
    possible = ["unshare", "-Urm", "true"]
    if shutil.which("unshare") is None or subprocess.run(possible, check=False).returncode:
        pytest.skip("no mount namespaces for users here; test_full_disk.py")
    disk = SmallDisk(tmp_path / "disk")
    path = rig.folder / "small.toml"
    path.write_text(
        rig.rig.path.read_text().replace(f"{rig.folder}/sessions", f"{disk.folder}/sessions")
    )
    first, began = rig.newest, time.time_ns()
    disk.run(f"{sys.executable} -m rigwatch record {path} >/dev/null & echo $! >{tmp_path}/pid")
    rig.health_after("recorder", began)
    steps = (("disk", SIZE // 12), ("disk_almost_full", SIZE // 64), ("recording_stopped", 0))
    took: dict[str, list[float]] = {name: [] for name, _ in steps}
    # Other work on the machine only lengthens the times: the best of three counts.
    while len(took["disk"]) < 3 and any(min(t, default=9.0) > 1.0 for t in took.values()):
        for name, free in steps:
            begun, full = time.time_ns(), disk.fill(free)
            took[name].append((rig.raised(name, after_ns=begun).t_ns - full) * 1e-9)
        disk.run(f"rm {disk.folder}/ballast")
        for name, _ in steps:
            rig.cleared(name)
    assert all(min(times) <= 1.0 for times in took.values()), took
    last = rig.newest
    rig.judged(BOOT, last + 256)
    disk.run(f"kill $(cat {tmp_path}/pid); wait")
    disk.run(f"cp -r {disk.folder}/sessions {tmp_path}/out")
    disk.close()
    (folder,) = (tmp_path / "out").glob("*Z*")
    kept = recorded(folder)
    assert kept == list(range(kept[0], kept[-1] + 1)), "what waited in memory came"
    assert kept[-1] > last
    assert len(open_session(folder).segments) >= 2, "a new segment"
    judged = [n for n in numbers(rig.estimates(), BOOT) if n >= first]
    assert judged == list(range(judged[0], judged[-1] + 1)), "the monitor goes on"
