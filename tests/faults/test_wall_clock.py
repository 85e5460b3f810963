"""The wall clock of daq and monitor is set back while they run, by libfaketime."""

import importlib.util
import time
from pathlib import Path

import numpy as np
import pytest

from tests.faults.field import Field, SerialDevice

pytestmark = pytest.mark.xdist_group("faults-supervised")
BACK_S, LOOKS_S, DELAY_S = 30, 1.0, 1.0
"""Step, interval of the library's looks at its file, and what a busy machine may add [s]."""


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
    with Field(tmp_path, section) as rig:
        device = SerialDevice(tmp_path / "line")
        rig.beside(device.serve)
        rig.start()
        for name, value in {
            "LD_PRELOAD": str(library()),
            "FAKETIME_TIMESTAMP_FILE": str(offset),
            "FAKETIME_DONT_FAKE_MONOTONIC": "1",
            "DONT_FAKE_MONOTONIC": "1",
            "FAKETIME_CACHE_DURATION": "1",
        }.items():
            monkeypatch.setenv(name, value)
        rig.start("daq", "monitor")
        monkeypatch.undo()
        boot = device.device.boot
        rig.settle(device.device)
        first, began = device.device.next_seq, time.time_ns()
        set_by(offset, -BACK_S)
        event = rig.event("CLOCK STEP")
        assert f"set by -{BACK_S}.0 s" in event.text
        # The library looks at its file once a second, the monitor at its clock as often.
        assert event.t_ns + BACK_S * 10**9 - began <= 10**9 * (1.0 + LOOKS_S + DELAY_S)
        assert "-30.0" in rig.event("clock_step").text
        rig.judged(boot, first + 512)
        blocks = [b for b in rig.estimates() if b.boot == boot and b.seq >= first - 256]
        assert np.diff(np.concatenate([b.t_ns for b in blocks])).min() > 0
        seqs = np.concatenate([np.arange(b.seq, b.seq + len(b)) for b in blocks])
        assert (np.diff(seqs) == 1).all()
        assert rig.gaps == []
