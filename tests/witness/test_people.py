"""Who is notified of which alarm, and when."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import Alarm, newest_alarms, remember
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.witness import notices as notices_module
from rigwatch.witness.notices import Notices
from rigwatch.witness.people import (
    MaintenanceSection,
    PeopleFile,
    RecipientSection,
    load_people,
)

MONDAY = datetime(2026, 11, 23, 3, 0).astimezone()


def fault(name: str = "stale", state: str = "unacknowledged", severity: str = "error") -> Alarm:
    figures = (0.0, 0.0, 0.0)
    return Alarm(name, state, severity, "why", "", "", 0, -1, 1, *figures, False, "", -1)  # type: ignore[arg-type]


def notices(*recipients: RecipientSection, windows: tuple[MaintenanceSection, ...] = ()) -> Notices:
    return Notices(PeopleFile(recipients=recipients, maintenance=windows))


def told(who: Notices, minute: float, wall: datetime = MONDAY) -> list[tuple[str, str]]:
    return [(one.recipient, one.alarm.name) for one in who.due(minute * 60.0, wall)]


ANN = RecipientSection(name="ann", url="json://ann", repeat_minutes=10.0)
BOSS = RecipientSection(name="boss", url="json://boss", after_minutes=15.0, lowest="critical")


def test_once_then_again_until_somebody_has_seen_it() -> None:
    who = notices(ANN)
    who.hear(fault(severity="warning", name="small"), 0.0)
    assert told(who, 0) == []
    who.hear(fault(), 0.0)
    assert told(who, 0) == [("ann", "stale")]
    who.hear(fault(), 5.0)
    assert told(who, 9.9) == []
    assert told(who, 10) == [("ann", "stale")]
    assert told(who, 10.1) == []
    who.hear(fault(state="acknowledged"), 700.0)
    assert told(who, 100) == []
    who.hear(fault(), 6000.0)
    assert told(who, 101) == [("ann", "stale")]


def test_what_nobody_has_seen_goes_to_others() -> None:
    who = notices(ANN, BOSS)
    who.hear(fault("a", severity="critical"), 0.0)
    who.hear(fault("b", severity="critical"), 0.0)
    who.hear(fault("c"), 0.0)
    assert told(who, 0) == [("ann", "a"), ("ann", "b"), ("ann", "c")]
    who.hear(fault("b", "acknowledged", "critical"), 600.0)
    assert told(who, 14.9) == [("ann", "a"), ("ann", "c")]
    assert told(who, 15) == [("boss", "a")]
    assert told(who, 16) == []


def test_a_fault_of_a_moment_is_told_although_it_has_gone_by_then() -> None:
    who = notices(ANN)
    who.hear(fault(), 0.0)
    who.hear(fault(state="cleared_unacknowledged"), 0.05)
    assert told(who, 0.01) == [("ann", "stale")]
    assert told(who, 0.02) == []


def test_what_has_gone_unseen_is_repeated_and_goes_to_others_until_it_is_seen() -> None:
    who = notices(ANN, BOSS)
    who.hear(fault(severity="critical"), 0.0)
    assert told(who, 0) == [("ann", "stale")]
    who.hear(fault(state="cleared_unacknowledged", severity="critical"), 300.0)
    assert told(who, 10) == [("ann", "stale")]
    assert told(who, 15) == [("boss", "stale")]
    who.hear(fault(state="normal", severity="critical"), 960.0)
    assert told(who, 60) == []


@pytest.mark.parametrize(("pause", "sent"), [(9.0, 1), (11.0, 2)])
def test_what_comes_again_within_ten_minutes_is_the_same_alarm(pause: float, sent: int) -> None:
    who, got = notices(RecipientSection(name="once", url="json://once")), []
    states = ("unacknowledged", "cleared_unacknowledged", "unacknowledged")
    for minute, state in zip((0.0, 1.0, 1.0 + pause), states, strict=True):
        who.hear(fault(state=state), minute * 60.0)
        got += told(who, minute)
    assert len(got) == sent


def test_in_maintenance_nobody_is_told_until_it_is_over() -> None:
    once = MaintenanceSection(
        name="bearing", begin=MONDAY, end=MONDAY + timedelta(hours=1), still="critical"
    )
    who = notices(ANN, windows=(once,))
    who.hear(fault("a"), 0.0)
    who.hear(fault("b", severity="critical"), 0.0)
    who.hear(fault("c"), 0.0)
    assert told(who, 0, MONDAY) == [("ann", "b")]
    who.hear(fault("c", "cleared_unacknowledged"), 1.0)
    assert told(who, 5, MONDAY + timedelta(minutes=59.9)) == []
    assert told(who, 6, MONDAY + timedelta(hours=1)) == [("ann", "a")]


def test_an_alarm_that_comes_and_goes_is_sent_as_one_that_stands() -> None:
    often = RecipientSection(name="once", url="json://once")
    who = notices(ANN, BOSS, often)
    sent = []
    for half_minute in range(60):
        state = "cleared_unacknowledged" if half_minute % 2 else "unacknowledged"
        who.hear(fault(state=state, severity="critical"), 30.0 * half_minute)
        sent += told(who, half_minute / 2)
    assert [name for name, _ in sent].count("once") == 1
    assert [name for name, _ in sent].count("ann") == 3
    assert [name for name, _ in sent].count("boss") == 1
    who.hear(fault(severity="critical"), 60.0 * 41)
    assert ("once", "stale") in told(who, 41)


def test_what_was_seen_and_comes_again_is_sent_at_once() -> None:
    who = notices(ANN)
    for second, state in ((0, "unacknowledged"), (5, "acknowledged"), (6, "normal")):
        who.hear(fault(state=state), second)
        told(who, second / 60.0)
    who.hear(fault(), 10.0)
    assert told(who, 10 / 60.0) == [("ann", "stale")]


def test_a_weekly_window_may_pass_midnight() -> None:
    late = datetime(2026, 1, 1, 23, 30).time()
    weekly = MaintenanceSection(name="wash", days=("sun",), at=late, minutes=60.0)
    sunday = datetime(2026, 11, 22, 23, 45).astimezone()
    for minutes, holds in ((-20, False), (-15, True), (0, True), (44, True), (45, False)):
        assert weekly.holds(sunday + timedelta(minutes=minutes)) is holds
        assert weekly.holds((sunday + timedelta(minutes=minutes)).astimezone(UTC)) is holds
    assert not weekly.holds(sunday + timedelta(days=1))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[[recipients]]\nname = "a"', "neither url nor command"),
        ('[[recipients]]\nname = "a"\nurl = "x:"\ncommand = ["y"]', "both url and command"),
        ('[[recipients]]\nname = "a"\ncommand = ["y"]\n' * 2, "different names"),
        ('[[maintenance]]\nname = "m"', "no time or two"),
        ('[[maintenance]]\nname = "m"\ndays = ["sun"]\nat = 02:00:00', "no time or two"),
        ('[[recipients]]\nnme = "a"', "nme"),
    ],
)
def test_a_wrong_file_is_told_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "people.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=words) as refused:
        load_people(WitnessSection(people=str(file)))
    assert str(refused.value).startswith(str(file))


def test_the_command_of_the_section_is_a_recipient(tmp_path: Path) -> None:
    file = tmp_path / "people.toml"
    file.write_text('[[recipients]]\nname = "ann"\nurl = "json://localhost"\n')
    settings = WitnessSection(people=str(file), notify=("tell",), notify_from="warning")
    names = [(one.name, one.lowest) for one in load_people(settings).recipients]
    assert names == [("command", "warning"), ("ann", "error")]


def test_alarms_that_a_stranger_makes_up_fill_no_memory_and_the_newest_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(newest_alarms, "MOST_ALARMS", 20)
    monkeypatch.setattr(notices_module, "MOST_ALARMS", 20)
    who, known = notices(ANN), dict[str, Alarm]()
    remember(known, fault("over", state="normal"))
    remember(known, fault("standing"))
    for number in range(200):
        who.hear(fault(f"made up {number}"), 0.0)
        if number < 19:
            remember(known, fault(f"made up {number}"))
    assert "over" not in known, "what is over goes first"
    assert "standing" in known
    for number in range(200):
        remember(known, fault(f"made up {number}"))
    who.hear(fault("real", severity="critical"), 1.0)
    remember(known, fault("real"))
    assert len(known) == 20
    assert "real" in known
    assert len(told(who, 1)) == 20
    assert told(who, 11)[-1] == ("ann", "real")
