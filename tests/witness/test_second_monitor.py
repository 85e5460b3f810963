"""A second process that calls itself monitor, on a rig without keys: real processes throughout."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import SAID_KEY, Subscription
from rigwatch.wire.messages import ALARMS, ESTIMATES, EVENTS, MONITOR_STALE
from rigwatch.witness.doubles import RESTART
from tests.bus.rig import TestRig, kill
from tests.faults.field import least_of
from tests.monitor_process.model import monitor_section
from tests.waiting import eventually

pytestmark = pytest.mark.long
LEASE = 2.0
WITHIN = LEASE + RESTART + 1.0
"""The time that the row allows, and one second from the monitor's token to the alarm's stamp."""


class Watched:
    """A rig with its monitor, device and witness, and a place for a second monitor."""

    def __init__(self, folder: Path) -> None:
        self.beat = folder / "beat"
        section = f'{monitor_section(folder)}\n[witness]\nheartbeat_file = "{self.beat}"\n'
        self.rig = TestRig(folder, section, LEASE)
        self.rig.router()
        self.bus = self.rig.bus("observer")
        self.alarms, self.events = self.bus.listen(ALARMS), self.bus.subscribe(EVENTS)
        self.estimates: Subscription = self.bus.subscribe_lossy(ESTIMATES)
        self.said: list[tuple[str, str, str, int]] = []
        other = folder / "other"
        other.mkdir()
        self.other = self.rig.configure("other.toml", self.rig.listen, monitor_section(other))

    def start(self) -> None:
        for command in ("monitor", "witness"):
            self.rig.start("-m", "rigwatch", command, str(self.rig.path))
        self.rig.publisher(5, "--wave")
        eventually(lambda: bool(self.estimates.drain()), "estimates")
        eventually(self.beat.exists, "the heartbeat")

    def monitors(self) -> int:
        return len(self.bus.names(f"{SAID_KEY}/monitor"))

    def state(self) -> tuple[str, str]:
        """State and cause of the witness's alarm."""
        self.said += [(a.name, a.state, a.cause, a.t_ns) for a in self.alarms.drain()]
        own = [one for one in self.said if one[0] == MONITOR_STALE]
        return (own[-1][1], own[-1][2]) if own else ("", "")

    def beats(self) -> bool:
        """Whether the heartbeat is renewed within two seconds."""
        before = self.beat.stat().st_mtime_ns
        threading.Event().wait(2.0)
        return self.beat.stat().st_mtime_ns > before


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    made = Watched(tmp_path)
    with made.rig:
        made.start()
        yield made


@pytest.mark.nightly
def test_61_a_second_monitor_is_an_alarm_until_one_is_left(watched: Watched) -> None:
    def told() -> float:
        """From the second monitor's token to the alarm's stamp [s]; it ends again."""
        second = watched.rig.start("-m", "rigwatch", "monitor", str(watched.other))
        eventually(lambda: watched.monitors() == 2, "the second monitor")
        began = time.time_ns()
        eventually(lambda: watched.state()[0] == "unacknowledged", "the alarm")
        assert "2 processes call themselves monitor" in watched.state()[1]
        assert not watched.beats()
        raised = next(one[3] for one in reversed(watched.said) if one[1] == "unacknowledged")
        kill(second)
        eventually(lambda: watched.state()[0] == "cleared_unacknowledged", "its end")
        eventually(watched.beats, "the heartbeat again")
        return float(raised - began) * 1e-9

    assert watched.state() == ("", ""), "one monitor is no alarm"
    took = least_of(told, WITHIN, lambda: None)
    assert took > RESTART, "a restart is none either"
    assert "DUPLICATE SOURCE" in {event.code for event in watched.events.drain()}
