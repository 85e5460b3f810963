"""The alarms that operators have put on the shelf, served by the monitor on request."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime

import msgspec

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.alarm_list import no_monitor
from rigwatch.wire.bus.transport import Close
from rigwatch.wire.messages import PROVED, Identity
from rigwatch.wire.typed_files import JsonError, json_value

SHELF_KEY = "monitor/shelf"


@dataclass(frozen=True, slots=True)
class ShelvedAlarm:
    """An alarm that is not announced.

    Attributes:
        name: the alarm.
        until_ns: Unix time at which it is announced again by itself [ns].
        user: who shelved it.
        identity: whether the user was proved by a signature.
        text: the operator's remark.
        active: whether its condition holds now.
    """

    name: str
    until_ns: int
    user: str
    identity: Identity
    text: str
    active: bool


def shelf_line(shelved: ShelvedAlarm) -> str:
    """One line: until when and by whom it is shelved, the alarm, its condition, the remark."""
    until = datetime.fromtimestamp(shelved.until_ns / 1e9).astimezone()
    proved = " (proved)" if shelved.identity == PROVED else ""
    holds = "its condition holds" if shelved.active else "its condition does not hold"
    why = f": {shelved.text}" if shelved.text else ""
    return (
        f"shelved until {until:%Y-%m-%d %H:%M:%S} by {shelved.user}{proved}: {shelved.name}, "
        f"{holds}{why}"
    )


def serve_shelf(bus: Bus, shelved: Callable[[], Sequence[ShelvedAlarm]]) -> Close:
    """Reply with the result of `shelved()`, which is called in a thread of the bus."""
    return bus.serve(SHELF_KEY, lambda _: [msgspec.json.encode(shelved())])


def ask_shelf(bus: Bus, timeout: float = 1.0) -> list[ShelvedAlarm]:
    """The shelved alarms, the one whose time ends first at the beginning.

    Raises:
        BusError: no monitor answers.
    """
    for reply in bus.query(SHELF_KEY, timeout=timeout):
        try:
            return sorted(json_value(reply, list[ShelvedAlarm]), key=lambda one: one.until_ns)
        except JsonError:
            continue
    raise no_monitor(bus)
