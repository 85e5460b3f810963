"""Of a folder to which several rigs record, a rig's own recordings are taken."""

import os
from pathlib import Path

import numpy as np
import pytest

from rigwatch.browser.rig.onset import onset_of
from rigwatch.recorder import newest
from rigwatch.recorder.folders import choose, note_last
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm, Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info
from tests.bus.samples import block

STAMP = "20260501T120000Z"


def record(root: Path, rig: str, t_ns: int, written: int) -> Path:
    """A session of ten samples of the same device and boot, last written at `written` [s]."""
    folder = root / f"{rig}-{STAMP}"
    folder.mkdir(parents=True)
    index = np.arange(10)
    column = Column("position", "m", np.ones(10), np.zeros(10, np.uint8))
    with SessionWriter(folder / "000001.mcap", run_info(rig, 1.0, t_ns=t_ns)) as writer:
        writer.write(SampleBlock("rig", 1, 0, index, t_ns + index, (column,)))
    os.utime(folder / "000001.mcap", (written, written))
    return folder


@pytest.fixture
def root(tmp_path: Path) -> Path:
    record(tmp_path, "bench", 1_000, 100)
    record(tmp_path, "bench-2", 2_000, 200)
    record(tmp_path, "other", 3_000, 300)
    return tmp_path


def test_the_newest_recording_is_that_of_the_rig(root: Path) -> None:
    assert newest(root, "bench") == root / f"bench-{STAMP}"
    assert newest(root, "bench-2") == root / f"bench-2-{STAMP}"
    with pytest.raises(SessionError, match="found no recording of lathe, expected one"):
        newest(root, "lathe")


def test_an_onset_is_looked_for_in_recordings_of_the_rig(root: Path) -> None:
    limits = (2.0, 0.0, 1.0)
    alarm = Alarm(
        "link", "unacknowledged", "error", "cause", "remedy", "rig", 1, 5, 9, *limits, True, "", 5
    )
    onset = onset_of(root, "bench", alarm)
    assert onset.t_ns == 1_005
    assert onset.session.path == root / f"bench-{STAMP}"


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("last", ["20270115T080000Z", "20311016T000000Z"])
def test_a_recorder_goes_on_where_it_was_after_a_day_with_the_clock_ahead(
    tmp_path: Path, last: str, *, closed: bool
) -> None:
    now = 1_800_000_000
    days = {"20311016T000000Z": (now + 150_000_000, 5), "20270115T080000Z": (now, 7)}
    for stamp, (begin, boot) in days.items():
        folder = tmp_path / f"bench-{stamp}"
        folder.mkdir()
        run = run_info("bench", 256.0, t_ns=begin * 10**9, configuration_sha256="x")
        writer = SessionWriter(folder / "000001.mcap", run)
        writer.write(block(0, 100, boot=boot, start_ns=begin * 10**9))
        writer.flush()
        if closed and stamp != last:
            writer.close()
        writer.abandon()
        os.utime(folder / "000001.mcap", (begin + 1, begin + 1))
        if stamp == last:
            note_last(folder, "bench")
    run = run_info("bench", 256.0, t_ns=(now + 10) * 10**9, configuration_sha256="x")
    place = choose(tmp_path, run)
    assert place.last == (days[last][1], 99)
    assert (place.folder.name == f"bench-{last}") == (last == "20270115T080000Z")
