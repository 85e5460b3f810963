"""What a command may claim: the monitor's clock counts, and texts have bounds."""

from monitor.alarms import AlarmManager, Occasion, bounded
from monitor.alarms.operator import MAX_CLOCK_DIFFERENCE_NS
from rigwatch.wire.messages import LONGEST_NAME, LONGEST_TEXT, Alarm, AlarmCommand
from tests.alarms.alarm_signals import condition, newest, run, spell, time_of

YEAR_NS = 365 * 86_400 * 1_000_000_000
HOURS_8_NS = 8 * 3600 * 1_000_000_000
NOW = time_of(1000)


def friction() -> AlarmManager:
    alarms = AlarmManager()
    run(alarms, [condition("dry_friction", spell(1000, (100, 1000)))])
    alarms.take_changes()
    return alarms


def test_a_shelf_ends_after_eight_hours_of_the_monitors_clock() -> None:
    alarms = friction()
    far_off = AlarmCommand("dry_friction", "shelve", "ann", NOW + 50 * YEAR_NS)
    alarms.command(bounded(far_off, NOW))
    (record,) = alarms.take_changes()
    assert record.shelved_until_ns == NOW + HOURS_8_NS


def test_a_clock_that_is_a_little_off_keeps_its_time() -> None:
    command = AlarmCommand("dry_friction", "shelve", "ann", NOW - MAX_CLOCK_DIFFERENCE_NS)
    assert bounded(command, NOW) == command


def test_a_journal_poisoned_with_a_long_shelf_is_cut_on_reading() -> None:
    old = friction()
    old.command(AlarmCommand("dry_friction", "shelve", "ann", NOW + 50 * YEAR_NS))
    new = AlarmManager()
    new.restore(newest(old.take_changes()), NOW)
    said = new.report("disk", Occasion(t_ns=NOW + HOURS_8_NS + 1), active=False)
    assert [one.name for one in said if isinstance(one, Alarm)] == ["dry_friction"]


def test_names_and_texts_of_a_command_are_cut() -> None:
    long = "x" * 250_000
    kept = bounded(AlarmCommand(long, "reset", long, NOW, long), NOW)
    assert len(kept.user) == len(kept.name) == LONGEST_NAME
    assert len(kept.text) == LONGEST_TEXT
