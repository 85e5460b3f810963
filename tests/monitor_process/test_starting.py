"""At the start the monitor waits, but not for ever; one that fails leaves nothing open."""

import contextlib
from pathlib import Path

import pytest

from monitor.process.loop import MonitorProcess, suitable_model
from monitor.process.startup_grace import Patience
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import BusError, SessionError
from tests.bus.rig import TestRig
from tests.monitor_process.model import monitor_section

NOW = 1000.0


@pytest.mark.parametrize(("after", "alarmed"), [(4.0, False), (19.0, False), (20.5, True)])
def test_a_daq_that_never_appears_is_reported_late(after: float, alarmed: bool) -> None:
    patience = Patience(NOW)
    counted = patience.counted(NOW + after, after, daq_alive=False, heard=False)
    assert counted == (after if alarmed else 0.0)


@pytest.mark.parametrize(("after", "alarmed"), [(19.0, False), (20.5, True)])
def test_a_daq_without_samples_is_reported_late(after: float, alarmed: bool) -> None:
    patience, appears = Patience(NOW), NOW + 9.0
    assert patience.counted(appears, 9.0, daq_alive=True, heard=False) == 0.0
    counted = patience.counted(appears + after, 9.0 + after, daq_alive=True, heard=False)
    assert counted == (9.0 + after if alarmed else 0.0)


def test_a_daq_that_goes_again_before_its_first_sample_is_reported() -> None:
    patience = Patience(NOW)
    patience.counted(NOW + 1.0, 1.0, daq_alive=True, heard=False)
    assert patience.counted(NOW + 22.0, 22.0, daq_alive=False, heard=False) == 22.0


@pytest.mark.parametrize(
    ("running_s", "silent", "counted"),
    [(1.0, 0.3, 0.0), (1.0, 1.2, 1.2), (6.0, 0.11, 0.11), (3600.0, 0.11, 0.11)],
)
def test_only_the_first_seconds_may_stutter(
    running_s: float, silent: float, counted: float
) -> None:
    patience = Patience(NOW)
    patience.counted(NOW + 2.0, 0.0, daq_alive=True, heard=True)
    now = NOW + 2.0 + running_s
    assert patience.counted(now, silent, daq_alive=True, heard=True) == counted


def open_files() -> set[Path]:
    """What this process has open."""
    found = set()
    for link in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):  # the listing's own
            found.add(link.readlink())
    return found


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="open files are not listed here")
def test_a_rig_that_cannot_start_keeps_no_file(tmp_path: Path) -> None:
    rig = TestRig(tmp_path, monitor_section(tmp_path))
    assert rig.config.monitor is not None
    journal = Path(rig.config.monitor.journal)
    Path(f"{journal}.position").mkdir(parents=True)
    model = suitable_model(rig.config, rig.path)
    with pytest.raises(SessionError, match="position"):
        MonitorProcess(rig.config, rig.path, model, MemoryNetwork().bus("bench", "monitor"))
    assert journal.exists()
    assert journal.resolve() not in open_files()


@pytest.mark.parametrize("fails", ["subscribe_own", "announce"])
def test_a_rig_whose_bus_fails_at_the_start_can_start_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    """A process of several rigs tries again: a lock that was kept would refuse it for ever."""
    rig = TestRig(tmp_path, monitor_section(tmp_path))
    model = suitable_model(rig.config, rig.path)
    network = MemoryNetwork()
    bus = network.bus("bench", "monitor")

    def broken(*_: object) -> None:
        raise BusError("the router is gone")

    monkeypatch.setattr(bus, fails, broken)
    with pytest.raises(BusError):
        MonitorProcess(rig.config, rig.path, model, bus)
    MonitorProcess(rig.config, rig.path, model, network.bus("bench", "monitor")).close()
