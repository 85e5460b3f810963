"""A fault is detected first and named later: one alarm in the list, at the detection's instant."""

import pytest

from monitor.alarms import AlarmManager
from tests.alarms.alarm_signals import condition, order, run, spell, steps, times


def conditions(departure: tuple[int, int], **names: tuple[int, int]):
    found = [condition("departure", spell(1500, departure))]
    return found + [condition(name, spell(1500, stretch)) for name, stretch in names.items()]


@pytest.mark.parametrize("name", ["dry_friction", "stiction", "other_fault"])
def test_the_name_takes_the_departures_place_and_keeps_its_instant(name):
    alarms = AlarmManager()
    said = run(alarms, conditions((100, 1500), **{name: (400, 1500)}))
    assert steps(said) == [
        ("departure", "unacknowledged", 101),
        ("departure", "normal", 401),
        (name, "unacknowledged", 401),
    ]
    (standing,) = alarms.standing()
    assert (standing.name, standing.onset_seq, standing.first_out) == (name, 100, True)


def test_an_acknowledged_departure_is_announced_again_under_its_name():
    alarms = AlarmManager()
    whole = conditions((100, 1500), dry_friction=(400, 1500))
    first = [one.__class__(one.name, *(x[:200] for x in _arrays(one))) for one in whole]
    rest = [one.__class__(one.name, *(x[200:] for x in _arrays(one))) for one in whole]
    run(alarms, first)
    alarms.command(order("departure", "acknowledge", at=200))
    said = alarms.update("rig", 7, 200, times(1300, 200), rest)
    assert steps(said)[-1][:2] == ("dry_friction", "unacknowledged")


def test_a_second_name_in_one_departure_has_its_own_instant():
    alarms = AlarmManager()
    said = run(alarms, conditions((100, 1500), dry_friction=(400, 1500), stiction=(900, 1500)))
    stiction = said[-1]
    assert (stiction.name, stiction.onset_seq, stiction.first_out) == ("stiction", 900, False)


def test_one_departure_is_one_alarm_even_where_its_name_goes_first():
    alarms = AlarmManager()
    said = run(alarms, conditions((100, 900), dry_friction=(400, 600)))
    raised = [name for name, state, _ in steps(said) if state == "unacknowledged"]
    assert raised == ["departure", "dry_friction"]


def test_a_departure_that_outlives_the_reset_of_its_name_shows_again():
    alarms = AlarmManager()
    run(alarms, conditions((100, 1500), dry_friction=(400, 900)))
    alarms.command(order("dry_friction", "acknowledge", at=1500))
    said = alarms.command(order("dry_friction", "reset", at=1500))
    assert [one[:2] for one in steps(said)] == [
        ("dry_friction", "normal"),
        ("departure", "unacknowledged"),
    ]


def test_a_new_departure_after_a_latched_name_is_not_hidden_by_it():
    alarms = AlarmManager()
    flags = spell(1500, (100, 400), (1200, 1500))
    said = run(
        alarms,
        [condition("departure", flags), condition("dry_friction", spell(1500, (200, 400)))],
    )
    assert steps(said)[-1] == ("departure", "unacknowledged", 1201)


def test_only_what_comes_while_nothing_waits_to_be_seen_is_first_out():
    alarms = AlarmManager()
    stuck = condition("sensor_stuck.position", spell(1500, (50, 1500)))
    said = run(alarms, [*conditions((100, 1500)), stuck])
    assert [one.first_out for one in said] == [True, False]
    alarms.command(order("*", "acknowledge", at=1500))
    link = condition("sensor_spike.voltage", [1] * 20)
    (fresh,) = alarms.update("rig", 7, 1500, times(20, 1500), [link])
    assert fresh.first_out


def _arrays(one):
    return one.active, one.value, one.low, one.high


def test_a_departure_that_flickers_while_its_name_holds_is_not_announced_again():
    alarms = AlarmManager()
    flags = spell(1500, (100, 500), (900, 1400))
    named = spell(1500, (200, 1500))
    said = run(alarms, [condition("departure", flags), condition("dry_friction", named)])
    raised = [name for name, state, _ in steps(said) if state == "unacknowledged"]
    assert raised == ["departure", "dry_friction"]
