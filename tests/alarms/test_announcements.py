"""What is said and journalled at each transition, to the last field."""

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from monitor.alarms import AlarmManager, Announcement, Occasion
from monitor.alarms.kinds import AlarmSettings, kind_of
from monitor.alarms.manager import SHELF_LIFE_NS
from monitor.alarms.state import AlarmInstance
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages.message_types import Alarm, Event
from rigwatch.wire.rig_config import AlarmSection
from tests.alarms.alarm_signals import codes, condition, order, run, spell, steps, time_of, times

HOUR = 3600 * 256
MINUTE = 60 * 256


def at(seq: int, **more: object) -> Occasion:
    return Occasion("rig", 7, seq, time_of(seq), **more)  # type: ignore[arg-type]


def news(said: list[Announcement]) -> list[tuple[str, str, int, str]]:
    """Alarms as (name, state, time, user)."""
    return [(one.name, one.state, one.t_ns, one.user) for one in said if isinstance(one, Alarm)]


def events(said: list[Announcement]) -> list[Event]:
    return [one for one in said if isinstance(one, Event)]


def told(code: str, text: str, seq: int) -> Event:
    return Event("monitor/alarms", time_of(seq), "warning", code, text)


def journal(alarms: AlarmManager) -> list[tuple[str, str, bool, bool, str, str]]:
    """New records as (name, state, active, latched, text, user)."""
    return [
        (one.alarm.name, one.alarm.state, one.active, one.latched, one.text, one.alarm.user)
        for one in alarms.take_changes()
    ]


# ---- one alarm --------------------------------------------------------------------------------


def test_an_alarm_says_what_where_when_by_how_much_and_what_to_do():
    alarm = AlarmInstance("sensor_stuck.position", AlarmSettings(1, 1, latch=True))
    alarm.raise_(Occasion("rig", 7, 12, 99, 1.5, -1.0, 1.0, 9, "seen twice"), first_out=True)
    kind = kind_of("sensor_stuck")
    expected = Alarm(
        name="sensor_stuck.position",
        state="unacknowledged",
        severity="error",
        cause=f"{kind.cause.format(channel='position')}: seen twice",
        guidance=kind.guidance,
        device="rig",
        boot=7,
        seq=12,
        t_ns=99,
        value=1.5,
        low=-1.0,
        high=1.0,
        first_out=True,
        user="",
        onset_seq=9,
    )
    assert alarm.message() == expected
    assert alarm.message("ann", 0) == replace(expected, user="ann", t_ns=0)
    assert alarm.latched


def test_what_no_sample_decided_names_none():
    (said,) = AlarmManager().report("disk", Occasion(t_ns=5), active=True)
    assert (said.device, said.boot, said.seq, said.onset_seq, said.t_ns) == ("", 0, -1, -1, 5)
    assert isnan(said.value)
    assert isnan(said.low)
    assert isnan(said.high)
    assert said.cause == kind_of("disk").cause


def test_a_remark_does_not_latch_whatever_the_configuration_says():
    alarms = AlarmManager({"not_observable": AlarmSection(latch=True)})
    run(alarms, [condition("not_observable", spell(300, (10, 100)))])
    assert alarms.standing() == []


def test_a_remark_does_not_take_the_first_out_from_a_fault():
    alarms = AlarmManager()
    alarms.report("not_armed", at(1), active=True)
    (link,) = alarms.report("link", at(2), active=True)
    (stale,) = alarms.report("stale", at(3), active=True)
    assert (link.first_out, stale.first_out) == (True, False)


def test_a_cleared_alarm_that_nobody_saw_still_keeps_the_next_from_being_first_out():
    alarms = AlarmManager()
    alarms.report("loss", at(1), active=True)
    alarms.report("loss", at(2), active=False)
    (link,) = alarms.report("link", at(3), active=True)
    assert not link.first_out


def test_what_raises_an_alarm_again_is_judged_anew_for_the_first_out():
    alarms = AlarmManager()
    alarms.report("gap", at(1), active=True)
    alarms.command(order("gap", "acknowledge", at=2))
    alarms.report("gap", at(3), active=False)
    alarms.report("link", at(4), active=True)
    (gap,) = alarms.report("gap", at(5), active=True)
    assert not gap.first_out


def test_when_it_clears_an_alarm_keeps_its_onset_and_what_was_said():
    alarms = AlarmManager()
    alarms.report("gap", at(10, onset_seq=8, text="three samples"), active=True)
    alarms.command(order("gap", "acknowledge", at=11))
    (gone,) = alarms.report("gap", at(20, value=0.5), active=False)
    assert (gone.state, gone.seq, gone.onset_seq, gone.value) == ("normal", 20, 8, 0.5)
    assert gone.cause.endswith(": three samples")


def test_saying_the_same_again_changes_nothing():
    alarms = AlarmManager()
    assert alarms.report("link", at(1), active=False) == []
    alarms.report("link", at(2), active=True)
    alarms.take_changes()
    assert alarms.report("link", at(3), active=True) == []
    assert journal(alarms) == []


def test_what_a_latched_alarm_does_is_journalled_although_nothing_is_announced():
    alarms = AlarmManager()
    alarms.report("link", at(1), active=True)
    alarms.command(order("link", "acknowledge", at=2))
    alarms.take_changes()
    assert alarms.report("link", at(3), active=False) == []
    assert journal(alarms) == [("link", "acknowledged", False, True, "", "")]
    alarms.command(order("link", "reset", at=4, text="cable changed"))
    assert journal(alarms) == [("link", "normal", False, False, "cable changed", "ann")]


def test_a_disabled_alarm_stays_silent_when_it_comes_goes_and_leaves_the_shelf():
    alarms = AlarmManager({"gap": AlarmSection(enabled=False)})
    assert alarms.report("gap", at(1), active=True) == []
    alarms.command(order("gap", "shelve", at=2))
    said = alarms.command(order("gap", "unshelve", at=3))
    assert steps(said) == []
    assert alarms.standing() == []


def test_the_configurations_name_stands_in_the_error():
    with pytest.raises(ConfigError, match=r"rig\.toml"):
        AlarmManager({"nothing": AlarmSection()}, "rig.toml")
    with pytest.raises(ConfigError, match="configuration"):
        AlarmManager({"nothing": AlarmSection()})


# ---- order ------------------------------------------------------------------------------------


def test_alarms_of_one_sample_come_nearest_to_the_cause_first():
    found = [
        condition(name, spell(40, (10, 40)))
        for name in ("sensor_stuck.b", "sensor_stuck.a", "gap", "stale")
    ]
    said = run(AlarmManager(), found)
    assert [one.name for one in said] == ["stale", "gap", "sensor_stuck.a", "sensor_stuck.b"]


def test_alarms_of_one_block_come_in_the_order_of_their_samples():
    early, late = condition("gap", spell(40, (10, 40))), condition("stale", spell(40, (11, 40)))
    assert [one.name for one in run(AlarmManager(), [late, early])] == ["gap", "stale"]


def test_the_list_shows_the_first_out_and_then_the_oldest():
    alarms = AlarmManager()
    for seq, name in ((3, "loss"), (1, "disk"), (2, "gap")):
        alarms.report(name, at(seq), active=True)
    assert [one.name for one in alarms.standing()] == ["loss", "disk", "gap"]


@pytest.mark.parametrize(("boot", "seq"), [(8, 2), (7, 3), (7, 1)])
def test_a_run_continues_with_the_next_sample_of_the_same_boot_only(boot, seq):
    settings = {"gap": AlarmSection(persistence=3)}
    alarms, follows = AlarmManager(settings), AlarmManager(settings)
    first, second = condition("gap", [1, 1]), condition("gap", [1])
    for one in (alarms, follows):
        assert one.update("rig", 7, 0, times(2), [first]) == []
    assert alarms.update("rig", boot, seq, times(1, 9), [second]) == []
    assert steps(follows.update("rig", 7, 2, times(1, 2), [second])) == [
        ("gap", "unacknowledged", 2)
    ]


def test_a_block_without_samples_reports_nothing():
    assert AlarmManager().update("rig", 7, 0, np.zeros(0, np.int64), []) == []


# ---- names ------------------------------------------------------------------------------------


def named(alarms: AlarmManager) -> list[Announcement]:
    alarms.report("departure", at(10, value=2.0, onset_seq=9), active=True)
    return alarms.report("dry_friction", at(20, value=3.0, onset_seq=15), active=True)


def test_naming_says_when_the_departure_left_and_why():
    alarms = AlarmManager()
    departure, friction = named(alarms)
    assert (departure.name, departure.state, departure.seq) == ("departure", "normal", 20)
    assert (departure.t_ns, departure.value, departure.boot) == (time_of(20), 2.0, 7)
    assert (friction.onset_seq, friction.value, friction.first_out) == (9, 3.0, True)
    assert journal(alarms)[1:] == [
        ("departure", "normal", True, False, "named dry_friction", ""),
        ("dry_friction", "unacknowledged", True, True, "", ""),
    ]


def test_a_departure_that_follows_its_name_is_journalled_and_not_announced():
    alarms = AlarmManager()
    alarms.report("dry_friction", at(1), active=True)
    alarms.take_changes()
    assert alarms.report("departure", at(2), active=True) == []
    assert journal(alarms) == [("departure", "normal", True, False, "", "")]
    alarms.report("dry_friction", at(3), active=False)
    alarms.command(order("dry_friction", "acknowledge", at=4))
    said = alarms.command(order("dry_friction", "reset", at=5))
    assert news(said)[1:] == [("departure", "unacknowledged", time_of(5), "")]
    assert said[1].seq == 2


def test_a_departure_that_was_named_after_a_restart_of_the_device_left_at_the_new_boot():
    alarms = AlarmManager()
    alarms.report("departure", at(10), active=True)
    departure, _ = alarms.report("dry_friction", replace(at(3), boot=8), active=True)
    assert (departure.state, departure.boot, departure.seq) == ("normal", 8, 3)


def test_a_name_that_goes_by_itself_leaves_the_departure_at_that_instant():
    alarms = AlarmManager({"dry_friction": AlarmSection(latch=False)})
    named(alarms)
    alarms.command(order("dry_friction", "acknowledge", at=30))
    said = alarms.report("dry_friction", at(40), active=False)
    assert news(said) == [
        ("dry_friction", "normal", time_of(40), ""),
        ("departure", "unacknowledged", time_of(40), ""),
    ]
    (seen,) = alarms.command(order("departure", "acknowledge", at=50))
    assert seen.state == "acknowledged"


def test_a_departure_is_judged_anew_after_one_that_was_named():
    alarms = AlarmManager()
    named(alarms)
    for name in ("departure", "dry_friction"):
        alarms.report(name, at(30), active=False)
    for action in ("acknowledge", "reset"):
        alarms.command(order("dry_friction", action, at=31))
    alarms.report("departure", at(40), active=True)
    (seen,) = alarms.command(order("departure", "acknowledge", at=41))
    assert (seen.name, seen.state) == ("departure", "acknowledged")


def test_a_disabled_name_hides_no_departure():
    alarms = AlarmManager({"dry_friction": AlarmSection(enabled=False)})
    alarms.report("dry_friction", at(1), active=True)
    assert steps(alarms.report("departure", at(2), active=True)) == [
        ("departure", "unacknowledged", 2)
    ]


def test_a_shelved_name_still_stands_for_the_fault_until_it_is_gone():
    alarms = AlarmManager()
    named(alarms)
    assert steps(alarms.command(order("dry_friction", "shelve", at=30)))[1:] == []
    said = alarms.report("dry_friction", at(40), active=False)
    assert news(said) == [("departure", "unacknowledged", time_of(40), "")]


def test_a_departure_that_has_gone_is_not_raised_again_when_its_name_is_reset():
    alarms = AlarmManager()
    named(alarms)
    alarms.report("departure", at(30), active=False)
    alarms.report("dry_friction", at(31), active=False)
    alarms.command(order("dry_friction", "acknowledge", at=32))
    said = alarms.command(order("dry_friction", "reset", at=33))
    assert [one[:2] for one in steps(said)] == [("dry_friction", "normal")]


# ---- the shelf --------------------------------------------------------------------------------


def test_shelving_says_who_for_how_long_and_why():
    alarms = AlarmManager()
    alarms.report("gap", at(1), active=True)
    alarms.take_changes()
    said = alarms.command(order("gap", "shelve", at=2, text="known leak"))
    assert news(said) == [("gap", "normal", time_of(2), "ann")]
    assert events(said) == [told("alarm_shelved", "gap shelved by ann for 8 h: known leak", 2)]
    (record,) = alarms.take_changes()
    assert record.shelved_until_ns == time_of(2) + 8 * 3600 * 10**9
    assert (record.active, record.latched, record.text) == (True, False, "known leak")


def test_what_comes_off_the_shelf_by_itself_is_raised_at_that_instant():
    alarms = AlarmManager()
    alarms.report("gap", at(1), active=True)
    alarms.command(order("gap", "shelve", at=2))
    alarms.report("gap", at(3), active=False)
    alarms.report("gap", at(4, value=7.0), active=True)
    due = 2 + 8 * HOUR
    assert alarms.report("loss", at(due - 1), active=False) == []
    said = alarms.report("loss", at(due + 50), active=False)
    text = "gap taken off the shelf: its time on the shelf is over"
    assert events(said) == [told("alarm_unshelved", text, due)]
    assert news(said) == [("gap", "unacknowledged", time_of(due), "")]
    assert (said[-1].seq, said[-1].value) == (4, 7.0)
    assert alarms.report("loss", at(due + 9 * HOUR), active=False) == []


def test_what_comes_off_the_shelf_in_peace_is_journalled_with_who_did_it():
    alarms = AlarmManager()
    alarms.report("gap", at(1), active=True)
    alarms.command(order("gap", "shelve", at=2))
    alarms.report("gap", at(3), active=False)
    alarms.take_changes()
    said = alarms.command(order("gap", "unshelve", at=9, text="mended"))
    assert said == [told("alarm_unshelved", "gap taken off the shelf: ann", 9)]
    (record,) = alarms.take_changes()
    assert (record.alarm.user, record.text, record.alarm.t_ns) == ("ann", "mended", time_of(9))
    assert record.shelved_until_ns == 0
    (raised,) = alarms.report("gap", at(10), active=True)
    assert (raised.name, raised.state, raised.seq) == ("gap", "unacknowledged", 10)


def test_the_shelf_is_over_before_a_command_of_that_time_is_obeyed():
    alarms = AlarmManager()
    alarms.report("gap", at(1), active=True)
    alarms.command(order("gap", "shelve", at=2))
    said = alarms.command(order("gap", "acknowledge", at=3 + 8 * HOUR))
    assert [state for _, state, _ in steps(said)] == ["unacknowledged", "acknowledged"]


def test_a_command_to_every_channel_reports_nothing_of_those_it_does_not_change():
    alarms = AlarmManager()
    for seq, channel in enumerate("ab"):
        alarms.report(f"sensor_stuck.{channel}", at(seq), active=True)
    alarms.command(order("sensor_stuck.a", "acknowledge", at=5))
    said = alarms.command(order("sensor_stuck", "acknowledge", at=6))
    assert steps(said) == [("sensor_stuck.b", "acknowledged", 1)]


def test_a_refused_command_is_an_event_at_the_commands_time():
    alarms = AlarmManager()
    why = "reset of gap refused: no such alarm has been seen"
    assert alarms.command(order("gap", "reset", at=9)) == [told("alarm_command_refused", why, 9)]


# ---- floods -----------------------------------------------------------------------------------


def flooded(count: int = 15) -> AlarmManager:
    alarms = AlarmManager()
    for i in range(count):
        alarms.report(f"sensor_stuck.ch{i}", at(256 * i), active=True)
    return alarms


def test_a_flood_says_how_many_and_what_was_first():
    alarms = flooded(10)
    judged = at(2560, value=3.0, low=-2.0, high=2.0)
    said = alarms.report("sensor_stuck.ch10", judged, active=True)
    (flood,) = (one for one in said if isinstance(one, Alarm))
    assert (flood.name, flood.seq, flood.value, flood.high) == ("alarm_flood", 2560, 11.0, 10.0)
    assert isnan(flood.low)
    assert flood.cause.endswith(": first out was sensor_stuck.ch0")
    assert not flood.first_out
    text = "sensor_stuck.ch10 is unacknowledged, grouped in a flood"
    assert events(said) == [told("alarm_grouped", text, 2560)]


def test_a_name_does_not_count_as_a_further_alarm():
    alarms = flooded(9)
    said = named(alarms)
    assert codes(said) == []
    assert "alarm_grouped" in codes(alarms.report("sensor_stuck.x", at(2304), active=True))


def test_remarks_are_neither_counted_nor_grouped():
    alarms = flooded(10)
    assert codes(alarms.report("not_armed", at(2560), active=True)) == []
    alarms.report("sensor_stuck.x", at(2561), active=True)
    said = alarms.report("not_observable", at(2562), active=True)
    assert steps(said) == [("not_observable", "acknowledged", 2562)]


def test_a_grouped_alarm_that_is_acknowledged_by_itself_is_shown():
    alarms = flooded()
    said = alarms.command(order("sensor_stuck.ch12", "acknowledge", at=4000, text="seen"))
    assert news(said) == [("sensor_stuck.ch12", "acknowledged", time_of(4000), "ann")]
    states = [one.state for one in alarms.standing() if one.name != "sensor_stuck.ch12"]
    assert set(states) == {"unacknowledged"}


def test_whoever_acknowledges_a_flood_is_named_with_every_grouped_alarm():
    alarms = flooded()
    alarms.take_changes()
    said = alarms.command(order("alarm_flood", "acknowledge", at=4000, text="all seen"))
    assert news(said) == [("alarm_flood", "acknowledged", time_of(4000), "ann")]
    assert [one.text for one in events(said)] == [
        f"sensor_stuck.ch{i} is acknowledged, grouped in a flood" for i in range(10, 15)
    ]
    records = alarms.take_changes()
    assert {(one.alarm.user, one.text, one.alarm.t_ns) for one in records} == {
        ("ann", "all seen", time_of(4000))
    }
    assert len(records) == 6


def test_a_reset_of_the_flood_acknowledges_nothing():
    alarms = AlarmManager({"alarm_flood": AlarmSection(latch=True)})
    for i in range(15):
        alarms.report(f"sensor_stuck.ch{i}", at(256 * i), active=True)
    alarms.report("gap", at(2560 + 10 * MINUTE), active=False)
    alarms.command(order("alarm_flood", "reset", at=2561 + 10 * MINUTE))
    assert {one.state for one in alarms.standing() if one.name != "alarm_flood"} == {
        "unacknowledged"
    }


def test_the_end_of_a_flood_is_reported_with_its_instant_and_its_alarms():
    alarms = flooded()
    alarms.take_changes()
    ends = 10 * 256 + 10 * MINUTE
    said = alarms.report("gap", at(ends + 77), active=False)
    changes = alarms.take_changes()
    assert [(one.alarm.name, one.text) for one in changes] == [
        ("alarm_flood", ""),
        *((f"sensor_stuck.ch{i}", "shown again after the flood") for i in range(10, 15)),
    ]
    assert changes[0].active is False
    assert all(one.grouped is False for one in changes)
    shown = [(f"sensor_stuck.ch{i}", "unacknowledged", time_of(ends), "") for i in range(10, 15)]
    assert news(said) == [("alarm_flood", "cleared_unacknowledged", time_of(ends), ""), *shown]
    said = alarms.report("sensor_stuck.ch12", at(ends + 100), active=False)
    assert steps(said) == [("sensor_stuck.ch12", "cleared_unacknowledged", ends + 100)]


def test_after_a_flood_the_next_one_is_reported_again():
    alarms = flooded()
    ends = 10 * 256 + 10 * MINUTE
    alarms.report("gap", at(ends), active=False)
    alarms.command(order("*", "acknowledge", at=ends + 1))
    said = []
    for i in range(15):
        said += alarms.report(f"sensor_spike.ch{i}", at(ends + 2 + i), active=True)
    assert [name for name, _, _ in steps(said)].count("alarm_flood") == 1
    assert "alarm_flood" in {one.name for one in alarms.standing()}


# ---- series -----------------------------------------------------------------------------------


def test_the_end_of_a_series_is_reported_with_its_instant():
    alarms = AlarmManager()
    for i in range(6):
        alarms.report("link", at(256 * i), active=True)
        alarms.report("link", at(256 * i + 128), active=False)
    ends = 256 * 5 + 128 + MINUTE
    said = alarms.report("gap", at(ends + 9), active=False)
    assert news(said) == [("link", "cleared_unacknowledged", time_of(ends), "")]
    assert "came" not in alarms.report("link", at(ends + 10), active=True)[0].cause


def test_a_series_that_ends_while_its_condition_holds_goes_on_standing():
    alarms = AlarmManager()
    for i in range(6):
        alarms.report("link", at(256 * i), active=False)
        alarms.report("link", at(256 * i + 128), active=True)
    assert alarms.report("gap", at(256 * 5 + 128 + MINUTE), active=False) == []
    (standing,) = alarms.standing()
    assert (standing.name, standing.state) == ("link", "unacknowledged")
    (gone,) = alarms.report("link", at(3 * MINUTE), active=False)
    assert gone.state == "cleared_unacknowledged"


def test_a_series_that_was_put_on_the_shelf_is_raised_when_it_comes_again():
    alarms = AlarmManager()
    for i in range(6):
        alarms.report("gap", at(256 * i), active=True)
        alarms.report("gap", at(256 * i + 128), active=False)
    alarms.command(order("gap", "shelve", at=1700))
    alarms.command(order("gap", "unshelve", at=1701))
    assert steps(alarms.report("gap", at(1702), active=True)) == [("gap", "unacknowledged", 1702)]


# ---- restarts ---------------------------------------------------------------------------------


def restart(old: AlarmManager, now_ns: int | None = None) -> tuple[AlarmManager, list[Alarm]]:
    newest = {record.alarm.name: record for record in old.take_changes()}
    new = AlarmManager()
    return new, new.restore(newest.values(), now_ns)


def test_a_restart_changes_no_field_of_what_stands():
    old = AlarmManager()
    occasion = at(30, value=1.0, low=-2.0, high=2.0, onset_seq=28)
    old.report("sensor_stuck.position", occasion, active=True)
    old.report("loss", at(40, value=2.0, low=0.0, high=1.0, onset_seq=40), active=True)
    new, standing = restart(old)
    assert standing == old.standing() == new.standing()
    (gone,) = new.report("sensor_stuck.position", at(50), active=False)
    assert (gone.state, gone.onset_seq, gone.first_out) == ("cleared_unacknowledged", 28, True)
    assert new.command(order("loss", "reset", at=60))[0].code == "alarm_command_refused"


def test_a_restart_keeps_what_was_added_to_a_cause_and_adds_nothing():
    old = flooded()
    old.command(order("sensor_stuck.ch0", "acknowledge", at=4000, text="looking"))
    _, standing = restart(old)
    causes = {one.name: one.cause for one in standing}
    assert causes == {one.name: one.cause for one in old.standing()}
    assert causes["alarm_flood"].endswith(": first out was sensor_stuck.ch0")


def test_a_cause_in_the_words_of_another_version_is_not_said_twice():
    old = AlarmManager()
    old.report("loss", at(1), active=True)
    (record,) = old.take_changes()
    former = replace(record, alarm=replace(record.alarm, cause="samples went missing"))
    (standing,) = AlarmManager().restore([former])
    assert standing.cause == kind_of("loss").cause


def test_after_a_restart_an_unnamed_departure_shows_again():
    old = AlarmManager()
    named(old)
    new, standing = restart(old)
    assert [one.name for one in standing] == ["dry_friction"]
    new.report("dry_friction", at(30), active=False)
    new.command(order("dry_friction", "acknowledge", at=31))
    said = new.command(order("dry_friction", "reset", at=32))
    assert news(said)[1:] == [("departure", "unacknowledged", time_of(32), "")]


def test_after_a_restart_a_departure_on_the_shelf_stays_there():
    old = AlarmManager()
    old.report("departure", at(10), active=True)
    old.command(order("departure", "shelve", at=11))
    new, standing = restart(old)
    assert standing == []
    assert new.command(order("*", "acknowledge", at=12)) == []
    said = new.command(order("departure", "unshelve", at=13))
    assert [state for _, state, _ in steps(said)] == ["unacknowledged"]


def test_a_level_survives_a_restart():
    old = AlarmManager()
    run(old, [condition("gap", spell(40, (10, 40)))])
    new, _ = restart(old)
    lasting = condition("gap", spell(300, (0, 20)))
    assert steps(new.update("rig", 7, 40, times(300, 40), [lasting])) == [
        ("gap", "cleared_unacknowledged", 40 + 20 + 255)
    ]


def test_after_a_restart_a_flood_still_knows_what_was_first():
    old = AlarmManager()
    old.report("gap", at(0), active=True)
    old.report("gap", at(0), active=False)
    old.command(order("gap", "acknowledge", at=0))
    old.report("loss", at(1), active=True)
    old.report("disk", at(2), active=True)
    new = AlarmManager()
    newest = {record.alarm.name: record for record in old.take_changes()}
    new.restore(newest[name] for name in ("loss", "disk", "gap"))
    said = []
    for i in range(11):
        said += new.report(f"sensor_stuck.ch{i}", at(10 + i), active=True)
    flood = next(one for one in said if isinstance(one, Alarm) and one.name == "alarm_flood")
    assert flood.cause.endswith("first out was loss")


def test_a_flood_whose_first_alarm_is_not_known_names_none():
    old = AlarmManager()
    old.report("loss", at(1), active=True)
    old.report("disk", at(2), active=True)
    new = AlarmManager()
    new.restore(old.take_changes()[-1:])
    for i in range(11):
        new.report(f"sensor_stuck.ch{i}", at(10 + i), active=True)
    (flood,) = (one for one in new.standing() if one.name == "alarm_flood")
    assert flood.cause == kind_of("alarm_flood").cause


def test_nothing_stays_on_the_shelf_longer_than_a_shift_from_the_restart():
    old = AlarmManager()
    old.report("gap", at(10 * HOUR), active=True)
    old.command(order("gap", "shelve", at=10 * HOUR))
    records = old.take_changes()
    back = time_of(0)
    for now_ns, ends in ((back, back + SHELF_LIFE_NS), (None, time_of(18 * HOUR))):
        new = AlarmManager()
        new.restore(records[-1:], now_ns)
        assert new.report("loss", Occasion(t_ns=ends - 1), active=False) == []
        assert codes(new.report("loss", Occasion(t_ns=ends), active=False)) == ["alarm_unshelved"]


def test_another_reason_of_a_standing_alarm_is_announced_once_in_its_state() -> None:
    alarms = AlarmManager()
    assert alarms.reword("link", "no answer", 1) == [], "nothing stands"
    alarms.report("link", Occasion("rig", 7, 9, 10, text="no answer"), active=True)
    assert alarms.reword("link", "no answer", 20) == [], "it has been told"
    (said,) = alarms.reword("link", "another device", 30)
    assert isinstance(said, Alarm)
    assert (said.state, said.t_ns, said.seq) == ("unacknowledged", 30, 9)
    assert said.cause.endswith(": another device")
    assert alarms.take_changes()[-1].alarm == said, "the journal has it"
    alarms.command(order("link", "acknowledge", at=40))
    (seen,) = alarms.reword("link", "no answer", 50)
    assert isinstance(seen, Alarm)
    assert seen.state == "acknowledged"
    alarms.report("link", Occasion("rig", 7, 9, 60), active=False)
    assert alarms.reword("link", "another device", 70) == [], "its condition has gone"
