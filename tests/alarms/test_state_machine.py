"""Each arrow of the ISA-18.2 diagram in `monitor/alarms/state.py`, walked once."""

import pytest

from monitor.alarms import AlarmManager, Occasion
from monitor.alarms.kinds import AlarmSettings
from monitor.alarms.state import AlarmInstance
from rigwatch.wire.messages.message_types import Alarm, Event
from rigwatch.wire.rig_config import AlarmSection
from tests.alarms.alarm_signals import codes, condition, order, run, spell, steps, times

GONE_AFTER = AlarmSection(persistence=3, clear_after=10, latch=False)
LATCHED = AlarmSection(persistence=3, clear_after=10, latch=True)


def manager(section: AlarmSection, name: str = "departure") -> AlarmManager:
    return AlarmManager({name: section})


def test_raised_at_the_sample_that_completes_persistence_with_the_onset_kept():
    said = run(manager(LATCHED), [condition("departure", spell(50, (20, 50)))])
    (alarm,) = said
    assert isinstance(alarm, Alarm)
    assert (alarm.state, alarm.seq, alarm.onset_seq) == ("unacknowledged", 22, 20)
    assert (alarm.device, alarm.boot, alarm.t_ns) == ("rig", 7, said[0].t_ns)
    assert (alarm.value, alarm.low, alarm.high) == (22.0, -1.0, 1.0)
    assert alarm.cause
    assert alarm.guidance


def test_shorter_spells_than_persistence_raise_nothing():
    flags = spell(100, (10, 12), (20, 22), (30, 32))
    assert run(manager(LATCHED), [condition("departure", flags)]) == []


def test_dropouts_shorter_than_the_hysteresis_do_not_clear():
    flags = spell(100, (10, 20), (29, 40), (49, 60))
    said = run(manager(GONE_AFTER), [condition("departure", flags)])
    assert steps(said) == [
        ("departure", "unacknowledged", 12),
        ("departure", "cleared_unacknowledged", 69),
    ]


def test_without_latch_acknowledged_and_gone_is_normal():
    alarms = manager(GONE_AFTER)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    assert steps(alarms.command(order("departure", "acknowledge", at=20)))[0][1] == "acknowledged"
    said = alarms.update("rig", 7, 20, *_quiet(20))
    assert steps(said)[0][1] == "normal"
    assert alarms.standing() == []


def test_without_latch_gone_and_then_acknowledged_is_normal():
    alarms = manager(GONE_AFTER)
    run(alarms, [condition("departure", spell(60, (0, 20)))])
    assert [one.state for one in alarms.standing()] == ["cleared_unacknowledged"]
    assert steps(alarms.command(order("departure", "acknowledge")))[0][1] == "normal"


def test_latched_alarm_stays_until_acknowledged_and_reset():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(60, (0, 20)))])
    assert steps(alarms.command(order("departure", "acknowledge")))[0][1] == "acknowledged"
    assert steps(alarms.command(order("departure", "reset")))[0][1] == "normal"


def test_reset_before_it_was_seen_releases_the_latch_only():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(60, (0, 20)))])
    assert steps(alarms.command(order("departure", "reset")))[0][1] == "cleared_unacknowledged"
    assert steps(alarms.command(order("departure", "acknowledge")))[0][1] == "normal"


def test_reset_is_refused_while_the_condition_holds():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    (event,) = alarms.command(order("departure", "reset"))
    assert isinstance(event, Event)
    assert event.code == "alarm_command_refused"
    assert "still holds" in event.text
    assert alarms.standing()[0].state == "unacknowledged"


def test_a_latched_acknowledged_alarm_sounds_again_when_its_condition_returns():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(60, (0, 20)))])
    alarms.command(order("departure", "acknowledge", at=60))
    flags = condition("departure", spell(20, (5, 20)))
    said = alarms.update("rig", 7, 60, times(20), [flags])
    assert steps(said) == [("departure", "unacknowledged", 67)]
    assert said[0].onset_seq == 65


def test_a_remark_needs_nobody():
    alarms = AlarmManager()
    said = run(alarms, [condition("not_observable", spell(300, (10, 100)))])
    assert [state for _, state, _ in steps(said)] == ["acknowledged", "normal"]
    assert not said[0].first_out


def test_a_disabled_alarm_is_never_raised():
    alarms = manager(AlarmSection(enabled=False))
    assert run(alarms, [condition("departure", spell(60, (0, 50)))]) == []


def test_the_operators_name_time_and_text_are_kept():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    alarms.take_changes()
    command = order("departure", "acknowledge", user="Ann B.", at=77, text="seen at the rig")
    (said,) = alarms.command(command)
    (record,) = alarms.take_changes()
    assert (said.user, said.t_ns) == ("Ann B.", command.t_ns)
    assert (record.alarm, record.text) == (said, "seen at the rig")


@pytest.mark.parametrize(
    ("name", "action", "user", "why"),
    [
        ("departure", "acknowledge", "", "no user given"),
        ("departur", "acknowledge", "ann", "no such alarm"),
        ("departure", "unshelve", "ann", "not shelved"),
        ("link", "shelve", "ann", "critical"),
    ],
)
def test_commands_that_cannot_be_obeyed_give_the_reason(name, action, user, why):
    alarms = AlarmManager()
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    alarms.report("link", Occasion("rig", t_ns=order("", "reset", at=30).t_ns), active=True)
    before = alarms.standing()
    (event,) = alarms.command(order(name, action, user=user))
    assert event.code == "alarm_command_refused"
    assert why in event.text
    assert alarms.standing() == before


def test_a_shelved_alarm_is_silent_until_the_shift_is_over():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    said = alarms.command(order("departure", "shelve", at=20, text="known leak"))
    assert steps(said)[0][1] == "normal"
    assert codes(said) == ["alarm_shelved"]
    assert alarms.update("rig", 7, 20, times(20, 20), [condition("departure", [1] * 20)]) == []
    later = times(20, 20 + 8 * 3600 * 256)
    said = alarms.update("rig", 7, 40, later, [condition("departure", [1] * 20)])
    assert codes(said) == ["alarm_unshelved"]
    assert [state for _, state, _ in steps(said)] == ["unacknowledged"]


def test_taken_off_the_shelf_by_a_person_it_shows_at_once_if_it_still_holds():
    alarms = manager(LATCHED)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    alarms.command(order("departure", "shelve", at=20))
    said = alarms.command(order("departure", "unshelve", at=30))
    assert [state for _, state, _ in steps(said)] == ["unacknowledged"]


def test_a_run_does_not_continue_across_missing_samples():
    alarms = manager(LATCHED)
    alarms.update("rig", 7, 0, times(2), [condition("departure", [1, 1])])
    said = alarms.update("rig", 7, 500, times(3, 500), [condition("departure", [1, 1, 1])])
    assert steps(said) == [("departure", "unacknowledged", 502)]
    assert said[0].onset_seq == 500


def lossy(missing: int) -> AlarmManager:
    """A departure that has gone, on a line that loses `missing` samples after every eight."""
    alarms = AlarmManager({"departure": GONE_AFTER}, longest_hold=4)
    run(alarms, [condition("departure", spell(20, (0, 20)))])
    for first in range(20, 120, 8 + missing):
        alarms.update("rig", 7, first, times(8, first), [condition("departure", [0] * 8)])
    return alarms


@pytest.mark.parametrize(("missing", "clears"), [(1, True), (4, True), (5, False)])
def test_a_condition_that_has_gone_clears_across_gaps_that_the_estimates_bridge(missing, clears):
    gone = lossy(missing).standing()[0].state == "cleared_unacknowledged"
    assert gone == clears


def test_samples_lost_in_a_gap_do_not_count_as_samples_without_the_condition():
    alarms = AlarmManager({"departure": GONE_AFTER}, longest_hold=4)
    run(alarms, [condition("departure", spell(28, (0, 20)))])
    said = alarms.update("rig", 7, 31, times(8, 31), [condition("departure", [0] * 8)])
    assert steps(said) == [("departure", "cleared_unacknowledged", 32)]


def test_persistence_does_not_count_across_a_bridged_gap_either():
    alarms = AlarmManager({"departure": LATCHED}, longest_hold=4)
    alarms.update("rig", 7, 0, times(2), [condition("departure", [1, 1])])
    assert alarms.update("rig", 7, 3, times(2, 3), [condition("departure", [1, 1])]) == []


def _quiet(n: int):
    return times(n, 20), [condition("departure", [0] * n)]


def test_the_state_itself_does_not_let_go_of_a_condition_that_holds():
    alarm = AlarmInstance("departure", AlarmSettings(1, 1, latch=True))
    alarm.active = True
    alarm.raise_(Occasion(), first_out=True)
    alarm.acknowledge()
    assert not alarm.reset()
    assert alarm.state == "acknowledged"
    alarm.active = False
    assert alarm.reset()
    assert alarm.state == "normal"
