"""What an operator can do, after a restart of the monitor, with alarms that its last run left."""

import pytest

from monitor.alarms import AlarmManager, Occasion
from rigwatch.wire.messages.message_types import Alarm
from rigwatch.wire.rig_config import AlarmSection
from tests.alarms.alarm_signals import codes, condition, newest, order, spell, steps, time_of, times

SECOND = 256
HOUR = 3600 * SECOND


def at(seq: int) -> Occasion:
    return Occasion("rig", 7, seq, time_of(seq))


def restarted(
    old: AlarmManager, seq: int, **settings: AlarmSection
) -> tuple[AlarmManager, list[Alarm]]:
    new = AlarmManager(settings)
    return new, new.restore(newest(old.take_changes()), time_of(seq))


def flooded() -> AlarmManager:
    """Twelve alarms whose conditions have gone, grouped in a flood."""
    alarms = AlarmManager()
    for active in (True, False):
        for k in range(12):
            alarms.report(f"sensor_stuck.ch{k}", at(20 * SECOND * active + k), active=active)
    return alarms


def test_a_flood_ends_with_the_run_and_shows_what_it_grouped():
    new, said = restarted(flooded(), 40 * SECOND)
    assert ("alarm_flood", "cleared_unacknowledged") in {(one.name, one.state) for one in said}
    assert len(said) == 13
    new.command(order("*", "acknowledge", at=41 * SECOND))
    new.command(order("*", "reset", at=42 * SECOND))
    assert new.standing() == []


def test_what_is_told_after_a_restart_is_in_the_journal():
    old = flooded()
    journalled = old.take_changes()
    new = AlarmManager()
    said = new.restore(newest(journalled), time_of(40 * SECOND))

    written = {(one.alarm.name, one.alarm.state, one.alarm.t_ns) for one in
               (*journalled, *new.take_changes())}  # fmt: skip
    assert {(one.name, one.state, one.t_ns) for one in said} <= written


def test_an_acknowledged_flood_is_told_to_be_over():
    old = flooded()
    old.command(order("alarm_flood", "acknowledge", at=30 * SECOND))
    _, said = restarted(old, 40 * SECOND)
    (flood,) = (one for one in said if one.name == "alarm_flood")
    assert (flood.state, flood.t_ns) == ("normal", time_of(40 * SECOND))


@pytest.mark.parametrize(("name", "state"), [("slow_device", "normal"), ("link", "acknowledged")])
def test_a_series_acknowledged_in_a_pause_is_over_after_a_restart(name, state):
    """One that latches still waits for its reset."""
    old = AlarmManager()
    for k in range(12):
        old.report(name, at(2 * SECOND * k), active=k % 2 == 0)
    old.command(order(name, "acknowledge", at=25 * SECOND))
    new, said = restarted(old, 26 * SECOND)
    assert [one.state for one in said] == [state]
    new.command(order("*", "reset", at=27 * SECOND))
    assert new.standing() == []


def test_an_alarm_that_is_disabled_now_does_not_stand_and_comes_back_once_it_is_enabled():
    old = AlarmManager()
    old.report("clock_drift", at(1), active=True)
    disabled, said = restarted(old, 10, clock_drift=AlarmSection(enabled=False))
    assert [(one.name, one.state) for one in said] == [("clock_drift", "normal")]
    assert disabled.report("clock_drift", at(11), active=True) == []
    enabled, _ = restarted(disabled, 20)
    assert steps(enabled.report("clock_drift", at(21), active=True)) == [
        ("clock_drift", "unacknowledged", 21)
    ]


def test_a_departure_shows_again_where_its_name_is_disabled_now():
    old = AlarmManager()
    old.report("departure", at(1), active=True)
    old.report("dry_friction", at(2), active=True)
    _, said = restarted(old, 10, dry_friction=AlarmSection(enabled=False))
    assert [(one.name, one.state) for one in said] == [
        ("dry_friction", "normal"),
        ("departure", "unacknowledged"),
    ]


def test_a_disabled_departure_stays_away_where_its_name_is_disabled_too():
    old = AlarmManager()
    old.report("departure", at(1), active=True)
    old.report("dry_friction", at(2), active=True)
    off = AlarmSection(enabled=False)
    new, _ = restarted(old, 10, dry_friction=off, departure=off)
    assert new.standing() == []


def test_an_alarm_that_nothing_watches_for_any_more_clears_with_a_word_about_it():
    old = AlarmManager()
    for name in ("sensor_stuck.removed", "gap", "disk"):
        old.report(name, at(1), active=True)
    new, _ = restarted(old, 10)
    new.update("rig", 7, 11, times(8, 11), [condition("gap", spell(8, (0, 8)))])
    said = new.retire(["gap"], time_of(18))
    assert steps(said) == [("sensor_stuck.removed", "cleared_unacknowledged", -1)]
    assert codes(said) == ["alarm_not_watched"]
    assert new.holds("gap")
    assert new.holds("disk")
    for action in ("acknowledge", "reset"):
        new.command(order("sensor_stuck.removed", action, at=20))
    assert {one.name for one in new.standing()} == {"gap", "disk"}


def test_what_is_watched_for_again_is_raised_again():
    old = AlarmManager()
    old.report("sensor_stuck.away", at(1), active=True)
    new, _ = restarted(old, 10)
    new.retire([], time_of(18))
    lasting = condition("sensor_stuck.away", spell(8, (0, 8)))
    assert steps(new.update("rig", 7, 19, times(8, 19), [lasting])) == [
        ("sensor_stuck.away", "unacknowledged", 19)
    ]
