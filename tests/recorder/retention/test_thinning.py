"""The recorder thins its old sessions in the background."""

import time
from pathlib import Path

import pytest

from rigwatch.archive import Store, query
from rigwatch.archive.one_writer import one_writer
from rigwatch.recorder.retention import Thinning, thinning
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import EVENTS, Event
from rigwatch.wire.rig_config import RecorderSection, load_rig
from tests.archive.test_thin_oldest import recorded as session_of
from tests.recorder.test_recorder import CONFIG, recorded
from tests.recorder.test_session_length import Days, sessions
from tests.waiting import eventually


def configured(folder: Path, more: str) -> Path:
    path = folder / "rig.toml"
    path.write_text(CONFIG.format(port=1, folder=folder / "sessions") + more)
    return path


def test_what_was_recorded_long_ago_is_thinned_while_the_recording_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(thinning, "FIRST", 0.0)
    monkeypatch.setattr(thinning, "EVERY", 1.0)
    days = Days(
        configured(tmp_path, "session_days = 1.0\nthin_days = 1e-9\nthin_alarm_days = 1e-9")
    )
    events = days.network.bus("bench1", "screen").subscribe(EVENTS)
    days.passes()
    days.ends()
    days.passes()
    first, second = sessions(tmp_path / "rig.toml")
    told = list[Event]()

    def thinned() -> bool:
        days.now += 1.0
        days.recorder.turn(days.now, time.time_ns())
        told.extend(one for one in events.drain() if one.code == "RECORDING_THINNED")
        return bool(told)

    eventually(thinned, "the first session is thinned")
    assert first.name in told[0].text
    assert not first.exists()
    assert recorded(second) == [*range(20, 40)], "the one that is recorded stays"
    sql = "select sum(count)::int, min(low), max(high) from seconds"
    assert query(Store(str(first.parent)), sql).rows == [(20, 0.0, 19.0)]
    days.recorder.close(days.now, time.time_ns())


def test_a_trouble_that_lasts_is_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thinning, "FIRST", 0.0)
    old = session_of(tmp_path, 0)
    session_of(tmp_path, 1)
    settings = RecorderSection(folder=str(tmp_path), thin_days=1.0)
    thins, now, told = Thinning(settings, "bench1"), 0.0, list[Event]()

    def ended() -> bool:
        told.extend(thins.update(now, time.time_ns()))
        return thins._process is None

    with one_writer(Store(str(tmp_path))):
        for _ in range(3):
            thins.update(now, time.time_ns())
            eventually(ended, "a process has ended")
            now += thinning.EVERY
    assert [one.code for one in told] == ["THINNING_FAILED"]
    assert "expected one at a time" in told[0].text
    assert old.exists()
    thins.update(now, time.time_ns())
    eventually(ended, "the last has ended")
    assert told[-1].code == "RECORDING_THINNED"
    assert not old.exists()


def test_the_rigs_of_a_recorder_are_thinned_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(thinning, "FIRST", 0.0)
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        session_of(folder, 0)
        session_of(folder, 1)
    settings = [RecorderSection(folder=str(folder), thin_days=1.0) for folder in folders]
    first, second = (Thinning(one, "bench1") for one in settings)
    first.update(0.0, time.time_ns())
    second.update(0.0, time.time_ns())
    assert first._process is not None
    assert second._process is None, "the first is not done yet"
    told = list[Event]()

    def thinned() -> bool:
        for one in (first, second):
            told.extend(one.update(1.0, time.time_ns()))
        return len(told) == 2

    eventually(thinned, "both are thinned")
    assert [one.code for one in told] == ["RECORDING_THINNED"] * 2
    second._due = first._due = 0.0
    first.update(1.0, time.time_ns())
    first.close()
    second.update(1.0, time.time_ns())
    assert second._process is not None, "one that has ended is in nobody's way"
    second.close()


@pytest.mark.parametrize(
    "wrong",
    [
        "thin_days = 30.0",
        "session_days = 1.0\nthin_days = 30.0\nkeep_days = 30.0",
        "session_days = 1.0\nthin_alarm_days = 30.0\nkeep_alarm_days = 7.0",
    ],
)
def test_sessions_without_an_end_and_those_that_are_removed_before_are_refused(
    wrong: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=r"recorder\.thin_"):
        load_rig(configured(tmp_path, wrong))
