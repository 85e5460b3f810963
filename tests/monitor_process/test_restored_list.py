"""What the list of standing alarms says around a kill: nothing that is not yet on disk, all later.

A query is asked at the very moment at which a client may first get an answer.
"""

import errno
import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.alarms import AlarmJournal, AlarmRecord, Occasion, read_journal
from monitor.alarms.kinds import REPORTED
from rigwatch.wire.bus import Bus, Close, ask_alarm_list
from rigwatch.wire.bus.commands.alarm_list import KEY
from rigwatch.wire.bus.transport import Answer
from tests.monitor_process.test_process import Bench
from tests.waiting import eventually


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.monitor.close()


def raise_disk(bench: Bench) -> None:
    at = Occasion("rig", 7, 1, time.time_ns())
    bench.monitor.say(bench.monitor.rig.alarms.report("disk", at, active=True))


def test_a_monitor_that_starts_again_answers_with_all_its_alarms_from_the_first_moment(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    raise_disk(bench)
    bench.kill()
    first: list[list[str]] = []
    serve = Bus.serve

    def serve_and_ask(bus: Bus, key: str, answer: Answer) -> Close:
        close = serve(bus, key, answer)
        if key == KEY:
            first.append([alarm.name for alarm in ask_alarm_list(bench.observer)])
        return close

    monkeypatch.setattr(Bus, "serve", serve_and_ask)
    bench.start()
    assert first == [["disk"]]


def test_no_alarm_is_listed_that_a_kill_could_lose(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed: list[list[str]] = []
    write = AlarmJournal.write

    def ask_and_write(journal: AlarmJournal, records: list[AlarmRecord]) -> None:
        listed.append([alarm.name for alarm in ask_alarm_list(bench.observer)])
        write(journal, records)

    monkeypatch.setattr(AlarmJournal, "write", ask_and_write)
    raise_disk(bench)
    assert listed == [[]]
    assert [alarm.name for alarm in ask_alarm_list(bench.observer)] == ["disk"]


def test_a_return_to_normal_that_a_kill_kept_back_is_told_by_the_next_monitor(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def remark(*, active: bool) -> None:
        at = Occasion("rig", 7, 1, time.time_ns())
        bench.monitor.say(bench.monitor.rig.alarms.report("not_armed", at, active=active))

    remark(active=True)
    heard = bench.alarm_states()
    assert [name for name, _ in heard] == ["not_armed"]
    monkeypatch.setattr(bench.bus, "publish", lambda *_: None)  # written to the journal, not said
    remark(active=False)
    bench.kill()
    assert bench.alarm_states() == []
    bench.start()
    eventually(lambda: ("not_armed", "normal") in bench.alarm_states(), "the return is told")


def test_conditions_that_no_sample_shows_are_all_in_the_table(bench: Bench) -> None:
    """Else the first sample after a restart would clear such an alarm."""
    reports = bench.monitor._reports(bench.monitor._seen())
    assert {name for name, _, _ in reports} == REPORTED


def test_what_a_full_disk_kept_back_is_written_although_no_alarm_changes(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    def written() -> bool:
        bench.monitor.look_around()
        records, _ = read_journal(tmp_path / "alarms.jsonl")
        return "disk" in [record.alarm.name for record in records]

    bench.monitor.look_around()
    with monkeypatch.context() as failing:
        failing.setattr(os, "write", full)
        raise_disk(bench)
    eventually(written, "the alarm is in the journal")
