"""Between which samples a command took effect: what the monitor says of each that it takes.

A command carries the time of the operator's clock, which may be another one than that of the
samples, and either may be set. A replay gives it after the same sample at the same time.
"""

import re
from dataclasses import dataclass

from rigwatch.wire.bus.commands.command_check import command_mark
from rigwatch.wire.messages import AlarmCommand, Event

TAKEN = "alarm_command_taken"
_PLACE = re.compile(r" after sample (-?\d+) of boot (\d+) \[(command [0-9a-f]{16})\]$")


@dataclass(frozen=True, slots=True)
class TakenAt:
    """Where the monitor took a command.

    Attributes:
        mark: identifies the command, see `command_mark`.
        boot, seq: the last sample before it; number -1 before the boot's first.
        t_ns: the time at which it took effect [ns].
    """

    mark: str
    boot: int
    seq: int
    t_ns: int


def taken(
    command: AlarmCommand, obeyed: AlarmCommand, source: str, position: tuple[int, int]
) -> Event:
    """The event that tells where a command was taken.

    Args:
        command: as received.
        obeyed: as executed, with bounded texts and a valid time.
        source: of the event.
        position: (boot, seq) of the last sample that was judged.
    """
    boot, seq = position
    what = f"{obeyed.action} of {obeyed.name} by {obeyed.user}"
    text = f"{what} after sample {seq} of boot {boot} [{command_mark(command)}]"
    return Event(source, obeyed.t_ns, "info", TAKEN, text)


def taken_at(event: Event) -> TakenAt | None:
    """What such an event tells; None for another one."""
    found = _PLACE.search(event.text) if event.code == TAKEN else None
    if found is None:
        return None
    return TakenAt(found[3], int(found[2]), int(found[1]), event.t_ns)
