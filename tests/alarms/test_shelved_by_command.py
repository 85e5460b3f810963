"""An operator shelves an alarm and takes it off the shelf by `rigwatch ack`."""

import argparse
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from monitor.alarms import AlarmManager, Occasion
from monitor.process.operator_desk import OperatorDesk
from rigwatch.commands.alarms.ack import add_arguments, command_of, sent
from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import Bus, CommandCheck, serve_alarm_list
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import ALARMS, EVENTS, Alarm
from rigwatch.wire.rig_config import SecuritySection

Order = Callable[..., tuple[list[Alarm], list[str], str]]


@pytest.fixture
def alarms() -> AlarmManager:
    made = AlarmManager()
    for name in ("loss", "link"):
        made.report(name, Occasion("rig", 7, 0, time.time_ns()), active=True)
    return made


@pytest.fixture
def order(tmp_path: Path, alarms: AlarmManager) -> Iterator[Order]:
    """`rigwatch ack` on a rig whose monitor has these alarms."""
    network, secret = MemoryNetwork(), SecuritySection(secret=str(tmp_path / "secret"))
    monitor, stop = network.bus("r", "monitor"), threading.Event()
    monitor.announce()
    desk = OperatorDesk(monitor, CommandCheck(monitor, secret))
    serve_alarm_list(monitor, alarms.standing)
    thread = threading.Thread(target=obey, args=(monitor, desk, alarms, stop), daemon=True)
    thread.start()
    bus = network.bus("r", "ack-1", signer_of(secret, ""))
    yield lambda *words: sent(bus, command_of(read(*words), "ann"))
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
    changed, shelf, why_not = order("loss", "--shelve", "--text", "known")
    assert [(one.name, one.state, one.user) for one in changed] == [("loss", "normal", "ann")]
    assert (shelf, why_not) == (["loss shelved by ann for 8 h: known"], "")
    assert [one.name for one in alarms.standing()] == ["link"]
    _, shelf, why_not = order("loss", "--unshelve")
    assert (shelf, why_not) == (["loss taken off the shelf: ann"], "")
    assert {one.name for one in alarms.standing()} == {"link", "loss"}


def test_a_critical_alarm_is_not_shelved_nor_one_that_is_not_named(
    order: Order, alarms: AlarmManager
) -> None:
    changed, shelf, why_not = order("link", "--shelve")
    assert (changed, shelf) == ([], [])
    assert "critical" in why_not
    assert {one.name for one in alarms.standing()} == {"link", "loss"}
    with pytest.raises(RigwatchError, match="--shelve: found no alarm"):
        command_of(read("--shelve"), "ann")
