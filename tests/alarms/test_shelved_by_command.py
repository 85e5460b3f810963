"""An operator shelves an alarm and takes it off the shelf by `rigwatch ack`."""

import argparse
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from monitor.alarms import AlarmJournal, AlarmManager, Occasion
from monitor.process.operator_desk import OperatorDesk, shelf_of
from rigwatch.commands.alarms.ack import add_arguments, command_of
from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import (
    Bus,
    CommandAnswer,
    CommandCheck,
    ask_shelf,
    command_alarms,
    serve_alarm_list,
    serve_shelf,
    shelf_line,
)
from rigwatch.wire.bus.commands import alarm_command
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import BusError, RigwatchError
from rigwatch.wire.messages import ALARMS, EVENTS, PROVED, Alarm, AlarmCommand
from rigwatch.wire.rig_config import SecuritySection

Order = Callable[..., CommandAnswer]
HOURS_8_NS = 8 * 3600 * 10**9


@pytest.fixture
def alarms() -> AlarmManager:
    made = AlarmManager()
    for name in ("loss", "link"):
        made.report(name, Occasion("rig", 7, 0, time.time_ns()), active=True)
    return made


@pytest.fixture
def network() -> MemoryNetwork:
    return MemoryNetwork()


@pytest.fixture
def order(tmp_path: Path, alarms: AlarmManager, network: MemoryNetwork) -> Iterator[Order]:
    """`rigwatch ack` on a rig whose monitor has these alarms."""
    secret = SecuritySection(secret=str(tmp_path / "secret"))
    monitor, stop = network.bus("r", "monitor"), threading.Event()
    monitor.announce()
    desk = OperatorDesk(monitor, CommandCheck(monitor, secret))
    serve_alarm_list(monitor, alarms.standing)
    serve_shelf(monitor, lambda: shelf_of(alarms))
    thread = threading.Thread(target=obey, args=(monitor, desk, alarms, stop), daemon=True)
    thread.start()
    bus = network.bus("r", "ack-1", signer_of(secret, ""))
    yield lambda *words: command_alarms(bus, command_of(read(*words), "ann"))
    stop.set()
    thread.join()


def obey(bus: Bus, desk: OperatorDesk, alarms: AlarmManager, stop: threading.Event) -> None:
    while not stop.wait(0.01):
        for said in desk.execute(alarms, time.time_ns()):
            for one in said:
                bus.publish(ALARMS if isinstance(one, Alarm) else EVENTS, one)


def read(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args(["rig.toml", *words])


def test_an_alarm_is_shelved_and_taken_off_the_shelf(order: Order, alarms: AlarmManager) -> None:
    said = order("loss", "--shelve", "--text", "known")
    assert [(one.name, one.state, one.user) for one in said.changed] == [("loss", "normal", "ann")]
    assert (said.shelf, said.refusal) == (["loss shelved by ann for 8 h: known"], "")
    assert [one.name for one in alarms.standing()] == ["link"]
    begin = time.monotonic()
    said = order("loss", "--unshelve")
    assert (said.shelf, said.refusal) == (["loss taken off the shelf: ann"], "")
    assert time.monotonic() - begin < alarm_command.TIMEOUT / 2  # it is an answer: no more waiting
    assert {one.name for one in alarms.standing()} == {"link", "loss"}


def test_a_critical_alarm_is_not_shelved_nor_one_that_is_not_named(
    order: Order, alarms: AlarmManager
) -> None:
    said = order("link", "--shelve")
    assert (said.changed, said.shelf) == ([], [])
    assert "critical" in said.refusal
    assert {one.name for one in alarms.standing()} == {"link", "loss"}
    with pytest.raises(RigwatchError, match="--shelve: found no alarm"):
        command_of(read("--shelve"), "ann")


def test_the_shelf_is_listed_with_who_until_when_and_why(
    order: Order, alarms: AlarmManager, network: MemoryNetwork
) -> None:
    screen = network.bus("r", "screen")
    assert ask_shelf(screen) == []
    before = time.time_ns()
    order("loss", "--shelve", "--text", "cable on order")
    (one,) = ask_shelf(screen)
    assert (one.name, one.user, one.identity) == ("loss", "ann", "not proved")
    assert (one.text, one.active) == ("cable on order", True)
    assert before + HOURS_8_NS <= one.until_ns <= time.time_ns() + HOURS_8_NS
    line = shelf_line(one)
    assert line.endswith(" by ann: loss, its condition holds: cable on order")
    alarms.report("loss", Occasion("rig", 7, 1, time.time_ns()), active=False)
    (one,) = ask_shelf(screen)
    assert "its condition does not hold" in shelf_line(one)
    order("loss", "--unshelve")
    assert ask_shelf(screen) == []


def test_a_monitor_that_is_not_there_is_no_empty_shelf(network: MemoryNetwork) -> None:
    with pytest.raises(BusError, match="no monitor of rig r answers"):
        ask_shelf(network.bus("r", "screen"))


def test_a_restarted_monitor_knows_who_shelved_what(tmp_path: Path, alarms: AlarmManager) -> None:
    now = time.time_ns()
    alarms.command(AlarmCommand("loss", "shelve", "ann", now, "known"), PROVED)
    alarms.report("loss", Occasion("rig", 7, 9, now), active=False)
    journal = AlarmJournal(tmp_path / "alarms.jsonl")
    journal.write(alarms.take_changes())
    journal.close()
    new = AlarmManager()
    new.restore(AlarmJournal(tmp_path / "alarms.jsonl").newest(), now)
    (one,) = shelf_of(new)
    assert (one.name, one.user, one.identity, one.text) == ("loss", "ann", PROVED, "known")
    assert one.until_ns == now + HOURS_8_NS


def test_an_alarm_on_the_shelf_stays_there_when_its_better_name_goes(
    alarms: AlarmManager,
) -> None:
    def report(name: str, seq: int, *, active: bool) -> None:
        alarms.report(name, Occasion("rig", 7, seq, time.time_ns()), active=active)

    report("departure", 1, active=True)
    report("dry_friction", 2, active=True)
    alarms.command(AlarmCommand("departure", "shelve", "ann", time.time_ns()))
    report("dry_friction", 3, active=False)
    alarms.command(AlarmCommand("*", "acknowledge", "ann", time.time_ns()))
    alarms.command(AlarmCommand("*", "reset", "ann", time.time_ns()))
    assert "departure" not in {one.name for one in alarms.standing()}
    assert [one.name for one in shelf_of(alarms)] == ["departure"]
