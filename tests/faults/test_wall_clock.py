"""The wall clock of daq and monitor is set back while they run, by libfaketime."""

import importlib.util
import time
from pathlib import Path

import numpy as np
import pytest

from tests.faults.field import Field, SerialDevice

pytestmark = pytest.mark.xdist_group("faults-supervised")
BACK_S = 30


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
        told_after = event.t_ns + BACK_S * 10**9 - began
        assert told_after <= 2.1e9, told_after
        assert "-30.0" in rig.event("clock_step").text
        rig.judged(boot, first + 512)
        blocks = [b for b in rig.estimates() if b.boot == boot and b.seq >= first - 256]
        assert np.diff(np.concatenate([b.t_ns for b in blocks])).min() > 0
        seqs = np.concatenate([np.arange(b.seq, b.seq + len(b)) for b in blocks])
        assert (np.diff(seqs) == 1).all()
        print(first, [(o.active, o.alarm.seq, o.alarm.value, (o.alarm.t_ns-began)*1e-9) for o in rig.journalled("stale")])
        assert rig.journalled("stale") == []
        assert rig.gaps == []
