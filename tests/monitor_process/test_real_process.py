"""`rigwatch monitor`, `alarms` and `ack` as processes on a real router; the monitor is killed."""

import json
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.messages.message_types import EstimateBlock
from rigwatch.wire.messages.topics import ESTIMATES
from tests.bus.rig import TestRig, kill, rigwatch, stopped
from tests.monitor_process.model import monitor_section
from tests.waiting import PATIENCE, eventually


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


def test_commands_without_router_or_monitor_fail_in_one_line(rig: TestRig) -> None:
    for command in (("alarms", str(rig.path)), ("ack", str(rig.path), "--user", "ann")):
        failed = rigwatch(*command)
        assert failed.returncode == 2
        assert failed.stderr.count("\n") == 1
        assert "no router answers" in failed.stderr
    rig.router()
    failed = rigwatch("alarms", str(rig.path))
    assert "no monitor of rig bench answers" in failed.stderr
