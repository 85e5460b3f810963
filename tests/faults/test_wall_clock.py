"""The wall clock of daq, monitor and recorder is set while they run, by libfaketime."""

import importlib.util
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.messages import EstimateBlock, SampleBlock
from rigwatch.wire.session import open_session
from rigwatch.workbench.data.recorded_columns import read_columns
from rigwatch.workbench.study.study_file import Span
from sim_plant.serve import Device
from tests.faults.field import RATE, Field, SerialDevice, least_of
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("faults-supervised")
BACK_S, AHEAD_S = 30, 3600
"""Steps [s]."""


def library() -> Path:
    """The preloaded library, from its wheel."""
    found = importlib.util.find_spec("libfaketime")
    if found is None or not found.submodule_search_locations:
        pytest.skip("libfaketime has no wheel for this machine")
    folder = Path(next(iter(found.submodule_search_locations)))
    return next(iter(folder.rglob("libfaketime.so.1")))


def set_by(offset: Path, seconds: int) -> None:
    """The offset of the wall clock of processes that follow the file."""
    beside = offset.with_suffix(".new")
    beside.write_text(f"{seconds:+d}\n")
    beside.replace(offset)


@pytest.fixture
def clocked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Field, Device]]:
    """A rig whose daq, monitor and recorder follow a wall clock that a test sets."""
    offset = offset_of(tmp_path)
    set_by(offset, 0)
    section = f'adapter = "serial"\nport = "{tmp_path}/line"'
    recorder = f'[recorder]\nfolder = "{tmp_path}/sessions"\n'
    with Field(tmp_path, section, extra=recorder) as rig:
        device = SerialDevice(tmp_path / "line")
        rig.beside(device.serve)
        rig.start()
        for name, value in {
            "LD_PRELOAD": str(library()),
            "FAKETIME_TIMESTAMP_FILE": str(offset),
            "FAKETIME_DONT_FAKE_MONOTONIC": "1",
            "DONT_FAKE_MONOTONIC": "1",
            "FAKETIME_NO_CACHE": "1",
        }.items():
            monkeypatch.setenv(name, value)
        rig.start("daq", "monitor")
        # The library reads its file at each look at the clock; once a second suffices here.
        monkeypatch.delenv("FAKETIME_NO_CACHE")
        monkeypatch.setenv("FAKETIME_CACHE_DURATION", "1")
        rig.start("record")
        monkeypatch.undo()
        rig.settle(device.device)
        yield rig, device.device


def offset_of(folder: Path) -> Path:
    """The file that the wall clock of the rig's processes follows."""
    return folder / "offset"


@pytest.mark.nightly
def test_43_a_clock_that_is_set_back(clocked: tuple[Field, Device], tmp_path: Path) -> None:
    rig, device = clocked
    boot, first, steps = device.boot, device.next_seq, 0

    def step() -> float:
        """From setting the clock back to both events [s]."""
        nonlocal steps
        steps, began = steps + 1, time.time_ns()
        set_by(offset_of(tmp_path), -BACK_S * steps)
        # The monitor's clock is the machine's; daq's goes on as before.
        said = (
            ("CLOCK STEP", f"set by -{BACK_S}.0 s", BACK_S * steps * 10**9),
            ("clock_step", f"by -{BACK_S}.0", 0),
        )
        told = []
        for code, text, back_ns in said:
            eventually(lambda c=code: count(rig, c) >= steps, code)  # type: ignore[misc]
            event = [one for one in rig.events if one.code == code][steps - 1]
            assert text in event.text
            told.append((event.t_ns + back_ns - began) * 1e-9)
        assert min(told) > 0
        return max(told)

    least_of(step, 1.0, lambda: None)
    rig.judged(boot, first + 512)
    assert [count(rig, code) for code in ("CLOCK STEP", "clock_step")] == [steps, steps]
    blocks = [b for b in rig.estimates() if b.boot == boot and b.seq >= first - 256]
    forward_and_whole(blocks)
    assert rig.gaps == []
    (folder,) = (tmp_path / "sessions").glob("*Z*")
    eventually(lambda: last_recorded(folder) >= first + 512, "the recording")
    forward_and_whole(list(open_session(folder).samples()))


@pytest.mark.nightly
def test_63_a_clock_that_is_far_ahead_for_a_while(
    clocked: tuple[Field, Device], tmp_path: Path
) -> None:
    rig, device = clocked
    boot, first, alarms = device.boot, device.next_seq, len(rig.alarms)
    for number, ahead_s in enumerate((AHEAD_S, 0)):
        set_by(offset_of(tmp_path), ahead_s)
        for code in ("CLOCK STEP", "clock_step"):
            eventually(lambda c=code, n=number: count(rig, c) > n, code)  # type: ignore[misc]
        rig.judged(boot, device.next_seq + 512)
    last = device.next_seq
    rig.judged(boot, last)
    (text,) = [e.text for e in rig.events if e.code == "clock_step" and f"-{AHEAD_S}" in e.text]
    assert "set back with it" in text
    blocks = [b for b in rig.estimates() if b.boot == boot and b.seq >= first - 256]
    whole_and_back_once(blocks)
    assert abs(blocks[-1].t_ns[-1] - time.time_ns()) < 30 * 10**9, "stamps are right again"
    assert rig.gaps == []
    raised = {one.name for one in rig.alarms[alarms:] if one.state == "unacknowledged"}
    assert raised <= {"stale"}, "a machine that is busy may hold daq up"
    (folder,) = (tmp_path / "sessions").glob("*Z*")
    eventually(lambda: last_recorded(folder) >= last, "the recording")
    session = open_session(folder)
    whole_and_back_once(list(session.samples()))
    whole_and_back_once(list(session.estimates()))
    columns = read_columns(folder.parent, Span(session=folder.name))
    assert columns.dt == pytest.approx(1 / RATE, rel=2e-3)


def count(rig: Field, code: str) -> int:
    return sum(event.code == code for event in rig.events)


def last_recorded(folder: Path) -> int:
    blocks = list(open_session(folder).samples())
    return blocks[-1].seq + len(blocks[-1]) if blocks else -1


def forward_and_whole(blocks: list[SampleBlock] | list[EstimateBlock]) -> None:
    """Stamps only move forward, in the order of the numbers, and no number is missing."""
    assert np.diff(np.concatenate([b.t_ns for b in blocks])).min() > 0
    seqs = np.concatenate([np.arange(b.seq, b.seq + len(b)) for b in blocks])
    assert (np.diff(seqs) == 1).all()


def whole_and_back_once(blocks: list[SampleBlock] | list[EstimateBlock]) -> None:
    """No number is missing; stamps go back once, between two blocks."""
    seqs = np.concatenate([np.arange(b.seq, b.seq + len(b)) for b in blocks])
    assert (np.diff(seqs) == 1).all()
    assert all((np.diff(b.t_ns) > 0).all() for b in blocks)
    steps = np.diff(np.concatenate([b.t_ns for b in blocks]))
    assert np.sum(steps < 0) == 1
    assert steps.min() * 1e-9 == pytest.approx(-AHEAD_S, abs=1.0)
    assert steps.max() * 1e-9 == pytest.approx(AHEAD_S, abs=1.0)
