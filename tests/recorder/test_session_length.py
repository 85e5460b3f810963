"""A recorder that runs for long begins a session after the other; nothing is missing between."""

import json
import time
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.recorder.folders import age_of, new_folder
from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.recorder.session_length import DAY_S, SessionLength
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import ALARMS
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session, run_info
from tests.recorder.test_recorder import CONFIG, Source, alarm, recorded
from tests.waiting import eventually

SECOND_NS = 10**9


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    text = CONFIG.format(port=1, folder=tmp_path / "sessions")
    path.write_text(f"{text}session_days = 1.0\n")
    return path


class Days:
    """A recorder whose days are turned by hand."""

    def __init__(self, config: Path) -> None:
        self.network, self.rig = MemoryNetwork(), load_rig(config)
        self.source = Source(self.network.bus("bench1", "daq"))
        self.monitor = self.network.bus("bench1", "monitor")
        self.run = describe_run(config, self.rig)
        self.alarms, self.now = 0, 0.0
        self.start()

    def start(self) -> None:
        self.bus = self.network.bus("bench1", "recorder")
        self.recorder = Recorder(self.rig, self.run, self.bus)

    def passes(self, samples: int = 20) -> None:
        """Samples and an alarm come, and are recorded."""
        self.source.send(samples)
        self.monitor.publish(ALARMS, alarm(self.alarms))
        self.alarms += 1
        heard, reader = self.recorder.feed._numbered["alarms"], self.recorder.feed._reader

        def complete() -> bool:
            self.recorder.turn(self.now, time.time_ns())
            alarms = heard.positions().get("monitor", (0, -1))[1]
            sample = (reader.position or (0, -1))[1]
            return (alarms, sample) == (self.alarms - 1, self.source.next - 1)

        eventually(complete, "all is recorded")

    def ends(self) -> None:
        """A day is over; the session ends with the next turn."""
        self.now += DAY_S
        before = self.recorder.store.folder
        self.recorder.turn(self.now, time.time_ns())
        assert self.recorder.store.folder != before


def sessions(config: Path) -> list[Path]:
    return sorted((config.parent / "sessions").glob("bench1-*"), key=lambda f: f.stat().st_ctime_ns)


def alarms_of(folder: Path) -> list[int]:
    found = open_session(folder).messages(["alarms"])
    return [item.message.seq for item in found if hasattr(item.message, "seq")]


def test_each_day_has_a_session_and_nothing_is_missing_between(config: Path) -> None:
    days = Days(config)
    days.passes()
    days.now = 0.9 * DAY_S
    days.passes()
    for _ in range(2):
        days.ends()
        days.passes()
    days.recorder.close(days.now, time.time_ns())
    found = sessions(config)
    assert list(map(recorded, found)) == [[*range(40)], [*range(40, 60)], [*range(60, 80)]]
    assert list(map(alarms_of, found)) == [[0, 1], [2], [3]]
    assert [open_session(one).unclosed for one in found] == [()] * 3
    begins = [open_session(one).info.t_ns for one in found]
    assert begins == sorted(set(begins))


def test_one_that_is_killed_goes_on_in_the_session_of_the_day(config: Path) -> None:
    days = Days(config)
    days.passes()
    days.ends()
    days.passes()
    days.bus.close()  # as the kernel does for a killed one
    days.source.send(10)
    days.monitor.publish(ALARMS, alarm(days.alarms))
    days.alarms += 1
    days.start()
    days.passes()
    days.recorder.close(days.now, time.time_ns())
    assert list(map(recorded, sessions(config))) == [[*range(20)], [*range(20, 70)]]
    assert list(map(alarms_of, sessions(config))) == [[0], [1, 2, 3]]


def test_one_that_is_killed_as_a_day_ends_goes_on_in_the_last_session(config: Path) -> None:
    days = Days(config)
    days.passes()
    days.ends()
    days.bus.close()
    days.source.send(10)
    days.start()
    days.passes()
    days.recorder.close(days.now, time.time_ns())
    assert list(map(recorded, sessions(config))) == [[*range(50)]]


def test_the_age_of_a_session_counts_over_restarts_and_no_clock_ends_it(tmp_path: Path) -> None:
    begun = run_info("bench1", 256.0, t_ns=10**18)
    folder = new_folder(tmp_path, begun)
    later = run_info("bench1", 256.0, t_ns=10**18 + int(20 * 3600e9))
    assert age_of(folder, later) == pytest.approx(20 * 3600, abs=1)
    assert age_of(folder.with_name(f"{folder.name}-2"), later) == age_of(folder, later)
    assert age_of(tmp_path / "bench1-99999999T999999Z", later) == 0.0
    length = SessionLength(1.0, age_of(folder, later))
    assert [length.is_over(3600.0 * hour) for hour in (0, 3, 5)] == [False, False, True]
    behind = SessionLength(1.0, -1e9)
    assert [behind.is_over(3600.0 * hour) for hour in (0, 23, 25)] == [False, False, True]
    assert not SessionLength(0.0, 1e9).is_over(1e9)


def test_what_a_rig_recorded_long_ago_is_thinned_while_it_goes_on(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    days = Days(config)
    days.passes()
    days.ends()
    days.passes()
    first, second = sessions(config)
    ended = max(int(block.t_ns[-1]) for block in open_session(first).samples())
    eventually(lambda: time.time_ns() > ended + SECOND_NS, "the first session is in the past")
    archive = str(first.parent)
    for words in (["index", archive], ["retain", archive, "--keep-days", "1e-9", "--keep-seconds",
                                       "--remove"]):  # fmt: skip
        assert main(["archive", *words]) == 0
    assert not first.exists()
    assert recorded(second) == [*range(20, 40)], "the one that is recorded stays"
    capsys.readouterr()
    question = "select sum(count)::int as n, min(low) as low, max(high) as high from seconds"
    assert main(["archive", "query", archive, question, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert rows == [{"n": 20, "low": 0.0, "high": 19.0}]
    days.recorder.close(days.now, time.time_ns())
