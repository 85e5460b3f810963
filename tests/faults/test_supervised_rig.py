"""Faults of the monitor's process and of the configuration, under `rigwatch up`."""

import os
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rigwatch.supervisor.vitals import Limits
from rigwatch.wire.bus import ask_alarm_list
from rigwatch.wire.messages import Alarm
from rigwatch.wire.session import open_session
from tests.bus.rig import rigwatch
from tests.faults.field import Field, SerialDevice, least_of, numbers
from tests.tooling.test_up import Rig as Up
from tests.waiting import PATIENCE, eventually

pytestmark = [pytest.mark.xdist_group("faults-supervised"), pytest.mark.long]
SECTIONS = """
[recorder]
folder = "{folder}/sessions"
[witness]
stale_after = 0.8
[dashboard]
viewer = "connect"
"""


class SupervisedRig(Field):
    """The rig under a supervisor, and its device."""

    def begin(self) -> None:
        self.device = SerialDevice(self.folder / "line-a")
        self.beside(self.device.serve)
        self.up = Up(self.rig.path)
        for process in ("router", "daq", "monitor", "witness"):
            self.comes("ready", process)
        self.bus = self.rig.bus("observer")
        self.beside(self._listen)
        self.settle(self.device.device)

    def comes(self, kind: str, process: str, after: float = 0.0) -> dict[str, Any]:
        """The first event of a kind and a process since a moment [s]; waits for it."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            for event in self.up.events:
                if (event["event"], event.get("process")) == (kind, process) and (
                    event["t"] >= after
                ):
                    return event
            self.up.wait_for("status")
        raise AssertionError(f"no {kind} of {process}")

    def pid(self, process: str) -> int:
        return int(self.up.wait_for("status")["processes"][process]["pid"])

    def each_is_judged_once(self, first: int) -> None:
        judged = [n for n in numbers(self.estimates(), self.device.device.boot) if n >= first]
        assert judged == list(range(first, judged[-1] + 1))

    def goes_on(self, samples: int = 64) -> None:
        self.judged(self.device.device.boot, self.device.device.next_seq + samples)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SupervisedRig]:
    folder = tmp_path_factory.mktemp("supervised")
    section = f'adapter = "serial"\nport = "{folder}/line-*"'
    with SupervisedRig(folder, section, extra=SECTIONS.format(folder=folder)) as made:
        made.begin()
        yield made
        made.up.end()


def rail(codes) -> None:  # type: ignore[no-untyped-def]
    codes[:, 2] = 32767


def test_40_a_monitor_that_is_killed(rig: SupervisedRig) -> None:
    rig.raised("sensor_saturated.acceleration", after_seq=rig.device.source.inject(rail, 8).sent())
    first = rig.device.device.next_seq

    def kill() -> float:
        pid, began = rig.pid("monitor"), time.time()
        os.kill(pid, signal.SIGKILL)
        return float(rig.comes("started", "monitor", began)["t"]) - began

    least_of(kill, 2.0, lambda: None)
    rig.goes_on()
    rig.each_is_judged_once(first)
    standing = {alarm.name: alarm for alarm in ask_alarm_list(rig.bus)}
    assert standing["sensor_saturated.acceleration"].state in (
        "unacknowledged",
        "cleared_unacknowledged",
    )


def test_41_a_monitor_that_hangs(rig: SupervisedRig) -> None:
    rig.goes_on()
    first = rig.device.device.next_seq

    def hang() -> float:
        """The longer of both times, each as a share of what is allowed."""
        pid, began = rig.pid("monitor"), time.time_ns()
        os.kill(pid, signal.SIGSTOP)
        raised, gone = stale_since(rig, began, 2)
        assert (raised.state, raised.severity) == ("unacknowledged", "critical")
        assert "the monitor sends no estimates" in raised.cause
        assert gone.state == "cleared_unacknowledged", "estimates come again"
        ill = rig.comes("ill", "monitor", began * 1e-9)
        started = float(rig.comes("started", "monitor", float(ill["t"]))["t"])
        rig.comes("ready", "monitor", started)
        assert not Path(f"/proc/{pid}").exists(), "it is killed"
        rig.goes_on()
        return max((raised.t_ns - began) * 1e-9 / 1.0, (started - began * 1e-9) / 5.0)

    least_of(hang, 1.0, lambda: None)
    rig.each_is_judged_once(first)


def _is_taken(taken: socket.socket, port: int) -> bool:
    """Whether the port could be taken; not while the router that was killed still has it.

    From then on no router that is started can listen there.
    """
    try:
        taken.bind(("127.0.0.1", port))
    except OSError:
        return False
    taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
    return True


@pytest.mark.nightly  # half a minute of a whole rig; a router that restarts is tried by day
def test_52_a_router_that_stays_away_for_long(rig: SupervisedRig) -> None:
    rig.goes_on()
    first, began = rig.device.device.next_seq, time.time()
    before = [rig.pid(process) for process in ("daq", "monitor", "recorder")]
    port = int(rig.rig.config.bus.router.rpartition(":")[2])
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        os.kill(rig.pid("router"), signal.SIGKILL)
        eventually(lambda: _is_taken(taken, port), "the router's port, before its next start")
        rig.comes("ended", "router", began)
        time.sleep(Limits().stall + 2.0)
        assert not rig.bus.connected()
        freed = time.time()
    rig.comes("ready", "router", freed)
    rig.goes_on()
    # Nobody was started anew for it: what a monitor has to say would have ended with it.
    assert [rig.pid(process) for process in ("daq", "monitor", "recorder")] == before
    rig.each_is_judged_once(first)
    said = [a for a in rig.alarms if a.name == "link" and a.t_ns >= began * 1e9]
    assert [a.state for a in said] == ["unacknowledged", "cleared_unacknowledged"]
    assert said[0].cause.endswith("the router does not answer")


def stale_since(rig: SupervisedRig, t_ns: int, count: int) -> list[Alarm]:
    """The first messages of the witness since a moment; waits for them."""
    found: list[Alarm] = []

    def said() -> bool:
        found[:] = [a for a in rig.alarms if a.name == "monitor_stale" and a.t_ns >= t_ns]
        return len(found) >= count

    eventually(said, "monitor_stale")
    return found[:count]


def test_48_a_dashboard_that_is_absent_frozen_or_killed(rig: SupervisedRig) -> None:
    for number in (signal.SIGSTOP, signal.SIGKILL):
        pid, first, began = rig.pid("dashboard"), rig.device.device.next_seq, time.time()
        os.kill(pid, number)
        since = len(rig.gaps)
        rig.goes_on(1024)

        def keeps_up(first: int = first) -> bool:
            sent = rig.device.device.next_seq - first
            judged = numbers(rig.estimates(), rig.device.device.boot)[-1] + 1 - first
            return judged >= 0.99 * sent

        eventually(keeps_up, "as many are judged as the device has sent, within 1 %")
        rig.each_is_judged_once(first)
        # The recorder may still report that the monitor was restarted in a test before.
        assert [gap for gap in rig.gaps[since:] if gap.device != "monitor"] == []
    rig.comes("started", "dashboard", began)


def changed(rig: SupervisedRig, text: str) -> str:
    """The supervisor's word about a new content of the configuration."""
    began, beside = time.time(), rig.rig.path.with_suffix(".new")
    beside.write_text(text)
    beside.replace(rig.rig.path)
    return str(rig.comes("changed", "configuration", began)["text"])


def test_44_a_configuration_that_is_wrong_or_changes(rig: SupervisedRig) -> None:
    good = rig.rig.path.read_text()
    wrong = good.replace("journal =", "jurnal =")
    line = 1 + good[: good.index("journal =")].count("\n")
    before = rig.pid("monitor")
    told = changed(rig, wrong)
    assert f"rig.toml:{line}: " in told
    assert "jurnal" in told
    assert rig.pid("monitor") == before, "all runs on"
    path = rig.folder / "wrong.toml"
    path.write_text(wrong)
    refused = rigwatch("daq", str(path))
    assert refused.returncode == 2
    assert f"wrong.toml:{line}: " in refused.stderr
    other = good + "[monitor.alarms.sensor_spike]\nenabled = false\n"
    daq, first = rig.pid("daq"), rig.device.device.next_seq
    assert "started anew: monitor, recorder" in changed(rig, other)
    rig.goes_on()
    assert rig.pid("daq") == daq
    assert rig.pid("monitor") != before
    rig.each_is_judged_once(first)

    def hashes() -> set[str]:
        folders = (rig.folder / "sessions").glob("*Z*")
        return {open_session(one).info.configuration for one in folders}

    eventually(lambda: other in hashes() and good in hashes(), "each session has its own")
