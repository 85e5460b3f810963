"""More alarms than a person can follow: grouped, the first-out and critical ones in sight."""

from itertools import pairwise

from monitor.alarms import AlarmManager, Occasion
from rigwatch.wire.messages.message_types import Alarm
from tests.alarms.alarm_signals import codes, condition, order, run, spell, steps, time_of, times

MINUTE = 60 * 256


def raised(alarms: AlarmManager, count: int, at: int = 0, apart: int = 256):
    """Sensor alarms of `count` channels, one after the other."""
    said = []
    for i in range(count):
        occasion = Occasion("rig", 7, t_ns=time_of(at + i * apart))
        said += alarms.report(f"sensor_stuck.ch{i}", occasion, active=True)
    return said


def test_ten_alarms_are_no_flood():
    said = raised(AlarmManager(), 10)
    assert len(said) == 10
    assert all(isinstance(one, Alarm) for one in said)


def test_the_eleventh_alarm_within_ten_minutes_begins_a_flood_that_names_the_first_out():
    alarms = AlarmManager()
    said = raised(alarms, 15)
    shown = [name for name, _, _ in steps(said)]
    assert shown == [f"sensor_stuck.ch{i}" for i in range(10)] + ["alarm_flood"]
    assert codes(said) == ["alarm_grouped"] * 5
    flood = next(one for one in said if isinstance(one, Alarm) and one.name == "alarm_flood")
    assert "sensor_stuck.ch0" in flood.cause
    assert alarms.standing()[0].name == "sensor_stuck.ch0"
    assert alarms.standing()[0].first_out
    assert len(alarms.standing()) == 16


def test_slower_alarms_are_no_flood():
    assert codes(raised(AlarmManager(), 15, apart=61 * 256)) == []


def test_a_critical_alarm_is_never_grouped():
    alarms = AlarmManager()
    raised(alarms, 15)
    said = alarms.report("link", Occasion("rig", t_ns=time_of(20 * 256)), active=True)
    assert steps(said) == [("link", "unacknowledged", -1)]


def test_after_the_flood_the_grouped_alarms_are_shown():
    alarms = AlarmManager()
    raised(alarms, 15)
    ends = 10 * 256 + 10 * MINUTE
    assert run_quiet(alarms, ends - 1) == []
    said = run_quiet(alarms, ends)
    shown = {name for name, _, _ in steps(said)}
    assert shown == {"alarm_flood"} | {f"sensor_stuck.ch{i}" for i in range(10, 15)}
    assert {one.t_ns for one in said} == {time_of(ends)}


def test_acknowledging_the_flood_acknowledges_what_is_grouped_in_it():
    alarms = AlarmManager()
    raised(alarms, 15)
    alarms.command(order("alarm_flood", "acknowledge"))
    states = {one.name: one.state for one in alarms.standing()}
    assert all(states[f"sensor_stuck.ch{i}"] == "acknowledged" for i in range(10, 15))
    assert all(states[f"sensor_stuck.ch{i}"] == "unacknowledged" for i in range(10))


def test_grouped_alarms_are_journalled():
    alarms = AlarmManager()
    raised(alarms, 15)
    names = {record.alarm.name for record in alarms.take_changes() if record.grouped}
    assert names == {f"sensor_stuck.ch{i}" for i in range(10, 15)}


def test_a_flood_does_not_depend_on_the_cut_of_blocks():
    conditions = [
        condition(f"sensor_stuck.ch{i}", spell(4000, (100 + 50 * i, 2000))) for i in range(14)
    ]
    whole, pieces = AlarmManager(), AlarmManager()
    said = run(whole, conditions)
    assert "alarm_grouped" in codes(said)
    assert repr(said) == repr(run(pieces, conditions, range(1, 4000, 17)))


def run_quiet(alarms: AlarmManager, seq: int):
    return alarms.update("rig", 7, seq, times(1, seq), [])


def test_a_flood_that_ends_within_a_block_ends_before_what_follows_in_it():
    """An alarm of the last samples comes after the flood's end, in one block as in many."""
    ends = 10 * 256 + 10 * MINUTE
    late = condition("sensor_spike.voltage", spell(40, (30, 40)))
    said = []
    for cuts in ((0, 40), (0, 10, 25, 40)):
        alarms = AlarmManager()
        raised(alarms, 15)
        heard = []
        for first, last in pairwise(cuts):
            part = condition(late.name, late.active[first:last])
            heard += alarms.update(
                "rig", 7, ends - 20 + first, times(40, ends - 20)[first:last], [part]
            )
        said.append(steps(heard))
    assert said[0] == said[1]
    assert said[0][-1] == ("sensor_spike.voltage", "unacknowledged", ends + 10)


def flap(alarms: AlarmManager, name: str, count: int, apart: int = 256, begin: int = 0):
    """The condition comes and goes `count` times, `apart` samples from coming to coming."""
    said = []
    for i in range(count):
        for active, after in ((True, 0), (False, apart // 2)):
            at = Occasion("rig", 7, t_ns=time_of(begin + i * apart + after))
            said += alarms.report(name, at, active=active)
    return said


def test_a_flapping_link_is_one_alarm_with_a_count_and_no_flood():
    alarms = AlarmManager()
    said = flap(alarms, "link", 60)
    assert len(steps(said)) == 4 * 2 + 1 + 3, "four comings and goings, then at 5, 10, 20 and 40"
    assert said[-1].cause.endswith("came 40 times")
    assert [one.name for one in alarms.standing()] == ["link"]
    assert "came 60 times" in alarms.standing()[0].cause
    assert alarms.standing()[0].state == "unacknowledged"


def test_a_series_that_is_over_clears_its_alarm_and_the_next_begins_anew():
    alarms = AlarmManager()
    flap(alarms, "link", 20)
    gone = 19 * 256 + 128
    assert run_quiet(alarms, gone + MINUTE - 1) == []
    (cleared,) = run_quiet(alarms, gone + MINUTE)
    assert (cleared.name, cleared.state) == ("link", "cleared_unacknowledged")
    assert len(steps(flap(alarms, "link", 2, begin=gone + 2 * MINUTE))) == 4


def test_a_flapping_alarm_that_was_acknowledged_stays_so():
    alarms = AlarmManager()
    flap(alarms, "stale", 8)
    alarms.command(order("stale", "acknowledge", at=8 * 256))
    flap(alarms, "stale", 8, begin=9 * 256)
    assert [one.state for one in alarms.standing()] == ["acknowledged"]


def test_a_flood_never_groups_an_alarm_that_asks_for_the_rig_to_be_stopped():
    for name in ("dry_friction", "stiction"):
        alarms = AlarmManager()
        raised(alarms, 15)
        said = alarms.report(name, Occasion("rig", t_ns=time_of(20 * 256)), active=True)
        assert steps(said) == [(name, "unacknowledged", -1)]


def test_a_flood_that_comes_and_goes_ends_like_any_other_alarm():
    """The monitor's clock an hour ahead of the samples' ends each flood at once."""
    alarms = AlarmManager()
    raised(alarms, 16, apart=25)
    hour = 3600 * 256
    for i in range(16, 32):
        alarms.pass_to(time_of(hour + i))
        at = Occasion("rig", 7, t_ns=time_of(i * 25))
        alarms.report(f"sensor_stuck.ch{i}", at, active=True)
    alarms.pass_to(time_of(2 * hour))
    states = {one.name: one.state for one in alarms.standing()}
    assert states.pop("alarm_flood") == "cleared_unacknowledged"
    assert set(states.values()) == {"unacknowledged"}
    assert len(states) == 32
