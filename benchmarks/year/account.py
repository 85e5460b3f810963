"""Whether the alarms of a year were right: none without a reason, each fault told.

An alarm has a reason if it comes
    while the rig is switched off, and until it runs      for alarms of the link
    while a fault of the plan lasts, or just after        for the alarms of that fault
    from a kill until everything runs again               for alarms of missing processes
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from monitor.alarms import read_journal

LINK = ("link", "stale", "gap", "loss", "monitor_stale")
KILL = (*LINK, "recording_stopped", "estimates_missing", "duplicate_source")
AFTER_S = 3.0
"""Time after a reason in which its alarms may still come [s]."""
BEFORE_S = 0.5
"""How far a rig that a busy machine delays lags behind the clock: the samples that it takes then
carry earlier times [s]."""


@dataclass(frozen=True)
class Reason:
    """A span of Unix time [ns] in which some alarms have a reason.

    Attributes:
        session: of the plan.
        what: for people.
        names: alarms that may be raised.
        told: alarms of which one must be raised; empty if none need be.
    """

    session: int
    what: str
    begin_ns: int
    end_ns: int
    names: tuple[str, ...]
    told: tuple[str, ...] = ()

    def covers(self, alarm: dict[str, Any]) -> bool:
        """Whether it explains the alarm."""
        first, last = self.begin_ns - int(BEFORE_S * 1e9), self.end_ns + int(AFTER_S * 1e9)
        return first <= alarm["t"] <= last and alarm["name"] in self.names

    def is_told(self, raised: Iterable[dict[str, Any]]) -> bool:
        """Whether one of the alarms tells it."""
        return not self.told or any(self.covers(a) and a["name"] in self.told for a in raised)


def raised(alarms: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Alarms that were raised, without remarks; each once."""
    found = {
        (one["name"], one["t"]): one
        for one in alarms
        if one["state"] == "unacknowledged" and one["severity"] != "info"
    }
    return list(found.values())


def without_reason(
    alarms: Sequence[dict[str, Any]], reasons: Sequence[Reason]
) -> list[dict[str, Any]]:
    """Alarms that nothing in the plan explains."""
    return [one for one in alarms if not any(reason.covers(one) for reason in reasons)]


def untold(alarms: Sequence[dict[str, Any]], reasons: Sequence[Reason]) -> list[Reason]:
    """Faults that no alarm told."""
    return [reason for reason in reasons if not reason.is_told(alarms)]


def missing_in_journal(alarms: Iterable[dict[str, Any]], journal: Path) -> tuple[int, int]:
    """Alarms of the monitor that the journal lacks, and how often it was rotated."""
    older = sorted(journal.parent.glob(f"{journal.name}.[0-9]"))
    records = [record for file in (*older, journal) for record in read_journal(file)[0]]
    written = {(one.alarm.name, one.alarm.t_ns) for one in records}
    heard = {(one["name"], one["t"]) for one in alarms if one["name"] != "monitor_stale"}
    return len(heard - written), len(older)
