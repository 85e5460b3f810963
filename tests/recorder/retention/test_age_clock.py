"""What a clock that is wrong by years does to recordings that are removed by their age: nothing."""

import os
from pathlib import Path

import numpy as np
import pytest

from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.recorder.retention import DAY, AgeClock, clock_of
from rigwatch.recorder.retention.age_clock import FASTEST, NOTED_EVERY
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.rig_config import RecorderSection
from tests.bus.rig import TestRig
from tests.recorder.retention.test_retention import NOW, left, rules, segment

YEARS = 10 * 365 * DAY
DAY_NS = round(DAY * 1e9)
BEGIN = 2 * 10**18


class Site:
    """A rig that keeps recordings for thirty days, and its machine's two clocks."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = folder / "sessions"
        self._rig = TestRig(folder, f'\n[recorder]\nfolder = "{self.root}"\nkeep_days = 30.0\n')
        self._boot = folder / "boot_id"
        monkeypatch.setattr("rigwatch.recorder.retention.age_clock._BOOT", self._boot)
        self.now, self.steady, self.ahead = NOW, 0.0, 0.0
        self._boots = 0
        self.reboots()
        self.recorder: Recorder | None = None

    def recorded(self, age_days: float) -> Path:
        """A recording of an earlier session."""
        name = f"bench-20260101T0000{len(left(self.root)):02}Z"
        return segment(self.root / name, 1, age_days)

    def reboots(self, off_s: float = 0.0) -> None:
        """The machine is off for a while."""
        self.now, self.steady = self.now + off_s, 5.0
        self._boots += 1
        self._boot.write_text(f"boot {self._boots}\n")

    def starts(self) -> None:
        config, path = self._rig.config, self._rig.path
        bus = MemoryNetwork().bus("bench", "recorder")
        self.recorder = Recorder(config, describe_run(path, config), bus)
        self.passes(1.0)

    def passes(self, seconds: float) -> None:
        assert self.recorder is not None
        begin = self.steady
        for at in np.arange(begin, begin + seconds, max(61.0, seconds / 100)):
            self.now, self.steady = self.now + at - self.steady, float(at)
            self.recorder.turn(self.steady, self._wall_ns)
        self.now, self.steady = self.now + begin + seconds - self.steady, begin + seconds

    def stops(self) -> None:
        assert self.recorder is not None
        self.recorder.close(self.steady, self._wall_ns)

    @property
    def _wall_ns(self) -> int:
        return round((self.now + self.ahead) * 1e9)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    return Site(tmp_path, monkeypatch)


def test_a_clock_that_is_years_ahead_for_a_while_makes_no_recording_old(site: Site) -> None:
    old = site.recorded(age_days=20.0)
    site.starts()
    site.passes(3600.0)
    site.ahead = YEARS
    site.passes(4 * 3600.0)
    assert old.exists()
    site.ahead = 0.0
    site.passes(9 * DAY)
    assert old.exists()
    site.passes(1.3 * DAY)
    assert not old.exists(), "in thirty days it is old"
    site.stops()


@pytest.mark.parametrize("boots", [False, True], ids=["the same boot", "after a reboot"])
@pytest.mark.parametrize("noted", [True, False], ids=["a note", "recordings alone"])
def test_a_recorder_that_starts_while_the_clock_is_years_ahead_removes_nothing(
    site: Site, noted: bool, boots: bool
) -> None:
    kept = [site.recorded(age_days) for age_days in (0.01, 10.0, 14.0)]
    if noted:
        site.starts()
        site.passes(3600.0)
        site.stops()
    site.ahead = YEARS
    for _ in range(3):
        if boots:
            site.reboots(off_s=60.0)
        site.starts()
        site.passes(3600.0)
        site.stops()
    assert all(one.exists() for one in kept)
    site.ahead = 0.0
    site.starts()
    site.passes(17 * DAY)
    assert [one.exists() for one in kept] == [True, True, False], "in thirty days one is old"
    site.stops()


def test_a_machine_that_was_off_is_believed_for_half_of_what_is_kept(site: Site) -> None:
    young, old = site.recorded(age_days=10.0), site.recorded(age_days=17.0)
    site.starts()
    site.passes(3600.0)
    site.stops()
    site.reboots(off_s=14.0 * DAY)
    site.starts()
    assert not old.exists()
    site.stops()
    site.reboots(off_s=100.0 * DAY)
    site.starts()
    assert not young.exists()
    site.stops()


def test_a_clock_that_begins_in_1970_at_each_start_keeps_no_recording_for_ever(site: Site) -> None:
    old = site.recorded(age_days=20.0)
    site.starts()
    site.stops()
    for _ in range(12):
        site.reboots(off_s=600.0)
        site.ahead = -site.now
        site.starts()
        site.passes(600.0)
        assert old.exists() or site.now > NOW + 10 * DAY
        site.ahead = 0.0
        site.passes(DAY)
        site.stops()
    assert not old.exists()


def test_what_was_written_in_1970_is_as_old_as_the_rest_of_its_session(tmp_path: Path) -> None:
    folder = tmp_path / "bench-19700101T000000Z"
    wrong, right = segment(folder, 1, 0.0), segment(folder, 2, age_days=20.0)
    alone = segment(tmp_path / "bench-19700101T010000Z", 1, 0.0)
    for path in (wrong, alone):
        os.utime(path, (600.0, 600.0))
    current = tmp_path / "bench-20270101T000000Z"
    retention = rules(tmp_path, keep_days=30.0)
    assert retention.update(0.0, round(NOW * 1e9), current) == []
    retention.update(100.0, round((NOW + 11 * DAY) * 1e9), current)
    assert not wrong.exists()
    assert not right.exists()
    assert alone.exists(), "nobody knows how old it is"


def ages(folder: Path, boot: str = "boot 1", newest_ns: int | None = None) -> AgeClock:
    return AgeClock(RecorderSection(keep_days=30.0), folder / ".bench.age", newest_ns, boot)


def test_a_clock_that_stays_ahead_is_followed_at_twice_the_speed(tmp_path: Path) -> None:
    clock = ages(tmp_path)
    assert clock.now_ns(0.0, BEGIN) == BEGIN
    ahead = BEGIN + 10**13
    assert clock.now_ns(100.0, ahead) == BEGIN + 200 * 10**9
    assert clock.lag_s == pytest.approx(9_800.0)
    assert clock.now_ns(5_100.0, ahead + 10**13) == BEGIN + 10_200 * 10**9
    assert clock.now_ns(30_000.0, ahead + 3 * 10**13) == BEGIN + 4 * 10**13
    assert clock.now_ns(30_001.0, BEGIN) == BEGIN, "back at once"
    assert clock.now_ns(30_002.0, BEGIN + 4 * 10**13) == BEGIN + 4 * 10**13, "and where it was"


def test_wrong_starts_do_not_add_up(tmp_path: Path) -> None:
    for day in range(50):
        now = BEGIN + day * DAY_NS
        clock = ages(tmp_path, f"boot {day}", newest_ns=BEGIN)
        assert clock.now_ns(1.0, now + 1000 * DAY_NS) <= now + 17 * DAY_NS
        assert clock.now_ns(100.0, now) == now


def test_where_the_clock_was_set_back_for_good_ahead_is_wrong_again(tmp_path: Path) -> None:
    clock = ages(tmp_path)
    clock.now_ns(0.0, BEGIN + 1000 * DAY_NS)
    for day in range(20):
        assert clock.now_ns(day * DAY, BEGIN + day * DAY_NS) == BEGIN + day * DAY_NS
    now = BEGIN + 19 * DAY_NS
    assert clock.now_ns(19 * DAY + 100.0, now + 900 * DAY_NS) == now + round(FASTEST * 100e9)


@pytest.mark.parametrize("content", ["", "{}", "[1]", '{"age_ns": 1e400}', "POISON"])
def test_a_note_that_no_clock_made_is_passed_over(tmp_path: Path, content: str) -> None:
    note = tmp_path / ".bench.age"
    ages(tmp_path).now_ns(0.0, BEGIN)
    text = note.read_text()
    note.write_text(content.replace("POISON", text.replace(str(BEGIN), str(1 << 62))))
    clock = ages(tmp_path, newest_ns=BEGIN)
    assert clock.now_ns(0.0, BEGIN + 1000 * DAY_NS) == BEGIN + 15 * DAY_NS


def test_the_time_is_noted_once_a_minute_and_only_where_something_is_kept(tmp_path: Path) -> None:
    note = tmp_path / ".bench.age"
    clock = ages(tmp_path)
    written = []
    for second in range(round(2 * NOTED_EVERY) + 1):
        clock.now_ns(float(second), BEGIN + second * 10**9)
        written.append(note.read_text())
    assert len(set(written)) == 3
    note.unlink()
    forever = clock_of(RecorderSection(folder=str(tmp_path)), "bench", BEGIN)
    assert forever.now_ns(0.0, BEGIN + DAY_NS) == BEGIN + DAY_NS
    forever.note()
    assert not note.exists()


def test_a_note_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    clock = AgeClock(RecorderSection(keep_days=30.0), tmp_path / "none" / ".bench.age")
    assert clock.now_ns(0.0, BEGIN) == BEGIN
    assert clock.now_ns(1.0, BEGIN + DAY_NS) == BEGIN + 2 * 10**9
