"""The plan of a year: when the rig runs, what happens to it, and which alarms that must raise."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

DAY_S = 86_400.0
YEAR_S = 365 * DAY_S
ZONE = "Europe/Berlin"
BEGIN = datetime(2027, 1, 1, tzinfo=UTC).timestamp()
SESSIONS = 1000
RUNNING_S = 25.0
"""Length of a session [s]; one in which a process is killed takes as long as that."""
AT_S, FOR_S = 12.0, 10.0
"""When a fault of a session sets in, and how long it lasts [s]."""


@dataclass(frozen=True)
class Fault:
    """Something that happens to the rig in a session.

    Attributes:
        begin, end: lines for the simulated rig's control.
        told: alarms of which one must be raised while it lasts; empty if none need be.
        also: other alarms that it may raise.
    """

    name: str
    begin: str
    end: str
    told: tuple[str, ...]
    also: tuple[str, ...] = ()


_LOST = ("gap", "loss", "link", "stale", "estimates_missing", "monitor_stale", "line_noise")
_RIG = ("departure", "dry_friction", "stiction", "other_fault")
FAULTS = (
    Fault("friction", "set coulomb=0.43", "clear", ("dry_friction",), _RIG),
    Fault("valve gain", "set actuator_gain=0.75", "clear", ("other_fault",), _RIG),
    Fault("position stuck", "set position_stuck=1", "clear", ("sensor_stuck.position",),
          (*_RIG, "sensor_invalid", "sensor_jumped.position")),
    Fault("acceleration stuck", "set acceleration_stuck=1", "clear",
          ("sensor_stuck.acceleration",), (*_RIG, "sensor_invalid", "sensor_jumped.acceleration")),
    Fault("supply drop", "set supply_drop=0.3", "clear", ("other_fault",), _RIG),
    Fault("cable pulled", "fault unplug 1024", "heal", ("link",), _LOST),
    Fault("frames lost", "fault lose 64", "heal", ("loss", "gap"), _LOST),
    Fault("noise on the line", "fault flip 1200", "heal", ("line_noise", "loss"), _LOST),
    Fault("device restarted", "restart", "", (), _LOST),
)  # fmt: skip
KILLED = ("daq", "monitor", "recorder", "witness", "router")


@dataclass(frozen=True)
class Session:
    """A run of the rig.

    Attributes:
        index: its number.
        begin: Unix time [s].
        fault: what happens, None for nothing.
        killed: process killed when a fault would set in, "" for none.
        leap: whether Unix time is set back by a second while it runs.
    """

    index: int
    begin: float
    fault: Fault | None = None
    killed: str = ""
    leap: bool = False

    @property
    def note(self) -> str:
        """What happens in it."""
        return self.fault.name if self.fault else f"{self.killed} killed" if self.killed else ""


def crossings() -> list[tuple[float, bool]]:
    """Instants that a session shall cross [Unix s], and whether one is a leap second's."""
    moments = [
        (datetime(2027, 3, 28, 1, tzinfo=UTC), False),  # clocks go forward
        (datetime(2027, 7, 1, tzinfo=UTC), True),
        (datetime(2027, 10, 31, 1, tzinfo=UTC), False),  # clocks go back
        (datetime(2027, 5, 4, 22, tzinfo=UTC), False),  # midnight, local time
        (datetime(2027, 5, 5, tzinfo=UTC), False),
        (datetime(2028, 1, 1, tzinfo=UTC), False),
    ]
    return [(moment.timestamp(), leap) for moment, leap in moments]


def year(count: int, seed: int = 1) -> Iterator[Session]:
    """`count` sessions of a year, in order; kills only in its first third."""
    chance = random.Random(seed)
    pause, special = YEAR_S / count, crossings()
    for index in range(count):
        begin = BEGIN + index * pause + chance.uniform(0.0, 0.5 * pause)
        if special_at := [one for one in special if one[0] < begin + pause]:
            special.remove(special_at[0])
            yield Session(index, special_at[0][0] - 10.0, leap=special_at[0][1])
            continue
        drawn = chance.random()
        fault = chance.choice(FAULTS) if drawn < 0.25 else None
        kills = drawn > 0.8 and index < count / 3
        yield Session(index, begin, fault, chance.choice(KILLED) if kills else "")
