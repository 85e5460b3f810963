"""What the alarms say at the moment: their states, and which of them matters most.

Fed with transitions in the order in which they come; no clock, no bus, no drawing.
"""

from dataclasses import dataclass, field

from rigwatch.wire.messages import PROBABLY_MISSING, Alarm, Event

LANES: dict[str, str] = {
    "departure": "departure from the model",
    "dry_friction": "dry friction",
    "stiction": "stiction",
    "other_fault": "other fault",
}
"""Alarms that have a lane from the start, with the words for people; others get one later."""
NAMED_FAULTS = ("dry_friction", "stiction", "other_fault")
_SEVERITIES = ("info", "warning", "error", "critical")


def title(name: str) -> str:
    """The alarm's name for people."""
    kind, _, channel = name.partition(".")
    words = LANES.get(kind, kind.replace("_", " "))
    return f"{words}, {channel}" if channel else words


def is_active(alarm: Alarm) -> bool:
    """Whether the alarm stands, seen or not."""
    return alarm.state in ("unacknowledged", "acknowledged")


@dataclass(slots=True)
class AlarmBook:
    """The last transition of each alarm.

    Attributes:
        last: by name.
        missing: what the model probably misses, by the alarm that asked for it.
    """

    last: dict[str, Alarm] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)

    def record(self, alarm: Alarm) -> bool:
        """Take one transition; true where it changes the alarm's state."""
        before = self.last.get(alarm.name)
        self.last[alarm.name] = alarm
        if before is None or before.onset_seq != alarm.onset_seq:
            self.missing.pop(alarm.name, None)
        return before is None or before.state != alarm.state

    def hear(self, event: Event) -> None:
        """Take what the ranking of effects has found, from the event that tells it."""
        if event.code == PROBABLY_MISSING:
            name, _, text = event.text.partition(": ")
            self.missing[name] = text

    def standing(self) -> list[Alarm]:
        """Alarms that are not normal, the oldest first."""
        return sorted(
            (a for a in self.last.values() if a.state != "normal"), key=lambda alarm: alarm.t_ns
        )

    def faults(self) -> list[Alarm]:
        """Alarms that stand and mean a fault: worst first, then first-out, then oldest."""
        standing = [a for a in self.last.values() if is_active(a) and a.severity != "info"]
        return sorted(standing, key=_rank)

    def remarks(self) -> list[Alarm]:
        """Remarks that stand: why there is no verdict, though nothing is wrong."""
        return [a for a in self.last.values() if is_active(a) and a.severity == "info"]

    def unseen(self) -> list[Alarm]:
        """Alarms that are over and that nobody has acknowledged; faults of the rig first."""
        gone = [a for a in self.last.values() if a.state == "cleared_unacknowledged"]
        return sorted(gone, key=lambda alarm: (alarm.name not in LANES, *_rank(alarm)))


def _rank(alarm: Alarm) -> tuple[int, bool, int]:
    return -_SEVERITIES.index(alarm.severity), not alarm.first_out, alarm.t_ns
