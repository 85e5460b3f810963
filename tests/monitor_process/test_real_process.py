"""`rigwatch monitor`, `alarms` and `ack` as processes on a real router; the monitor is killed."""

import json
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.alarms import read_journal
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.messages.message_types import Alarm, EstimateBlock, Health
from rigwatch.wire.messages.topics import ALARMS, ESTIMATES, HEALTH
from tests.bus.rig import TestRig, kill, rigwatch, stopped
from tests.monitor_process.model import monitor_section
from tests.waiting import PATIENCE, eventually

pytestmark = pytest.mark.long


class Judged:
    """Which samples of which boot have estimates."""

    def __init__(self, bus: Bus) -> None:
        self.numbers: dict[int, set[int]] = {}
        self._subscription = bus.subscribe(ESTIMATES)
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        for block in self._subscription:
            assert isinstance(block, EstimateBlock)
            numbers = range(block.seq, block.seq + len(block))
            self.numbers.setdefault(block.boot, set()).update(numbers)

    def last(self, boot: int) -> int:
        return max(self.numbers.get(boot, ()), default=-1)

    def reaches(self, boot: int, seq: int) -> None:
        eventually(lambda: self.last(boot) >= seq, f"estimates up to seq {seq}")

    def missing(self, boot: int) -> list[int]:
        numbers = self.numbers[boot]
        return sorted(set(range(min(numbers), max(numbers))) - numbers)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[TestRig]:
    with TestRig(tmp_path, monitor_section(tmp_path)) as made:
        yield made


def test_a_killed_or_frozen_monitor_judges_every_sample_and_keeps_its_alarms(rig: TestRig) -> None:
    rig.router()
    judged = Judged(rig.bus("observer"))
    monitor = rig.start("-m", "rigwatch", "monitor", str(rig.path))
    tokens = rig.bus("asker")
    eventually(lambda: "alive/monitor" in tokens.tokens("alive/*"), "the monitor is there")
    source = rig.publisher(5, "--wave")
    judged.reaches(5, 200)
    kill(monitor)
    monitor = rig.start("-m", "rigwatch", "monitor", str(rig.path))
    judged.reaches(5, judged.last(5) + 300)
    with stopped(monitor):
        before = judged.last(5)
    judged.reaches(5, before + 200)
    assert judged.missing(5) == []
    kill(source)

    def standing() -> list[str]:
        listed = rigwatch("alarms", str(rig.path), "--json")
        return [alarm["name"] for alarm in json.loads(listed.stdout)] if listed.stdout else []

    eventually(lambda: {"stale", "link"} <= set(standing()), "silence and its reason are alarms")
    done = rigwatch("ack", str(rig.path), "link", "--user", "ann", "--json")
    assert done.returncode == 0, done.stderr
    changed = json.loads(done.stdout)["changed"]
    assert [(a["name"], a["state"], a["user"]) for a in changed] == [
        ("link", "acknowledged", "ann")
    ]
    refused = rigwatch("ack", str(rig.path), "link", "--user", "ann", "--reset")
    assert refused.returncode == 1
    assert "its condition still holds" in refused.stderr
    monitor.send_signal(signal.SIGTERM)
    assert monitor.wait(PATIENCE) == 0


@pytest.mark.parametrize(
    "state", ["unacknowledged", pytest.param("normal", marks=pytest.mark.nightly)]
)
def test_a_kill_between_journal_and_delivery_leaves_no_change_untold(
    rig: TestRig, state: str
) -> None:
    rig.router()
    observer = rig.bus("observer")
    alarms, heard = observer.subscribe(ALARMS), list[Change]()

    def listen() -> list[Change]:
        heard.extend(map(change_of, alarms.drain()))
        return heard

    recorder = rig.bus("recorder")

    def disk(trouble: float, until: str) -> None:
        """A recorder's word about its disk, until the change that it causes is in the journal."""

        def written() -> bool:
            recorder.publish(
                HEALTH, Health("recorder", 1, "recording", "", {"disk_trouble": trouble})
            )
            return changes(rig, "disk")[-1:] == [until] or killed.poll() is not None

        eventually(written, f"disk {until}")

    killed = rig.start("-m", "tests.monitor_process.killed_monitor", str(rig.path), "disk", state)
    eventually(lambda: "alive/monitor" in observer.tokens("alive/*"), "the monitor is there")
    disk(1.0, "unacknowledged")
    disk(0.0, "cleared_unacknowledged")
    if state == "normal":
        for more in ((), ("--reset",)):  # the last is not answered
            rigwatch("ack", str(rig.path), "disk", "--user", "ann", *more)
    assert killed.wait(PATIENCE) == -signal.SIGKILL
    (change,) = [c for c in journalled(rig) if c[:2] == ("disk", state)]
    assert change not in listen(), "written and not said"
    rig.start("-m", "rigwatch", "monitor", str(rig.path))
    eventually(lambda: change in listen(), "the next monitor tells it")


Change = tuple[str, str, int]


def change_of(alarm: Alarm) -> Change:
    return alarm.name, alarm.state, alarm.t_ns


def journalled(rig: TestRig) -> list[Change]:
    return [change_of(one.alarm) for one in read_journal(rig.folder / "alarms.jsonl")[0]]


def changes(rig: TestRig, name: str) -> list[str]:
    """The states of an alarm, as the journal has them."""
    return [state for alarm, state, _ in journalled(rig) if alarm == name]


def test_commands_without_router_or_monitor_fail_in_one_line(rig: TestRig) -> None:
    for command in (("alarms", str(rig.path)), ("ack", str(rig.path), "--user", "ann")):
        failed = rigwatch(*command)
        assert failed.returncode == 2
        assert failed.stderr.count("\n") == 1
        assert "no router answers" in failed.stderr
    rig.router()
    failed = rigwatch("alarms", str(rig.path))
    assert "no monitor of rig bench answers" in failed.stderr
