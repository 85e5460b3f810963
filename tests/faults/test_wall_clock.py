"""The wall clock of daq, monitor and recorder is set back while they run, by libfaketime."""

import importlib.util
import time
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.messages import EstimateBlock, SampleBlock
from rigwatch.wire.session import open_session
from tests.faults.field import Field, SerialDevice, least_of
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("faults-supervised")
BACK_S = 30
"""Step [s]."""


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


def test_43_a_clock_that_is_set_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    offset = tmp_path / "offset"
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
        boot = device.device.boot
        rig.settle(device.device)
        first, steps = device.device.next_seq, 0

        def step() -> float:
            """From setting the clock back to both events [s]."""
            nonlocal steps
            steps, began = steps + 1, time.time_ns()
            set_by(offset, -BACK_S * steps)
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
