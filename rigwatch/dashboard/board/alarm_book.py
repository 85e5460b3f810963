"""The current alarm states, and which alarm matters most.

Updated with transitions in order of arrival; no clock, no bus, no drawing.
"""

from dataclasses import dataclass, field

from rigwatch.wire.messages import PROBABLY_MISSING, Alarm, Event, remember

LANES: dict[str, str] = {
    "departure": "departure from the model",
    "dry_friction": "dry friction",
    "stiction": "stiction",
    "other_fault": "other fault",
}
"""Alarms that have a lane from the start, with their labels; others get one later."""
NAMED_FAULTS = ("dry_friction", "stiction", "other_fault")
_SEVERITIES = ("info", "warning", "error", "critical")


def title(name: str) -> str:
    """The alarm's label."""
    kind, _, channel = name.partition(".")
    words = LANES.get(kind, kind.replace("_", " "))
    return f"{words}, {channel}" if channel else words


def is_active(alarm: Alarm) -> bool:
    """Whether the alarm is active, acknowledged or not."""
    return alarm.state in ("unacknowledged", "acknowledged")


@dataclass(slots=True)
class AlarmBook:
    """The last transition of each alarm.

    Attributes:
        last: by name.
        missing: the effect that the model probably lacks, by alarm.
    """

    last: dict[str, Alarm] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)

    def record(self, alarm: Alarm) -> bool:
        """Apply one transition; true if it changes the alarm's state."""
        before = self.last.get(alarm.name)
        remember(self.last, alarm)
        if before is None or before.onset_seq != alarm.onset_seq:
            self.missing.pop(alarm.name, None)
        return before is None or before.state != alarm.state

    def hear(self, event: Event) -> None:
        """Record the result of the effect ranking from its event."""
        if event.code == PROBABLY_MISSING:
            name, _, text = event.text.partition(": ")
            if name in self.last:
                self.missing[name] = text

    def standing(self) -> list[Alarm]:
        """Alarms that are not normal, oldest first."""
        return sorted(
            (a for a in self.last.values() if a.state != "normal"), key=lambda alarm: alarm.t_ns
        )

    def faults(self) -> list[Alarm]:
        """Active alarms that indicate a fault: worst first, then first-out, then oldest."""
        standing = [a for a in self.last.values() if is_active(a) and a.severity != "info"]
        return sorted(standing, key=_rank)

    def remarks(self) -> list[Alarm]:
        """Active remarks: why there is no verdict although nothing is wrong."""
        return [a for a in self.last.values() if is_active(a) and a.severity == "info"]

    def unseen(self) -> list[Alarm]:
        """Alarms that have cleared but are not acknowledged; faults of the rig first."""
        gone = [a for a in self.last.values() if a.state == "cleared_unacknowledged"]
        return sorted(gone, key=lambda alarm: (alarm.name not in LANES, *_rank(alarm)))


def _rank(alarm: Alarm) -> tuple[int, bool, int]:
    return -_SEVERITIES.index(alarm.severity), not alarm.first_out, alarm.t_ns
