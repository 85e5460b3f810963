"""Decides who is notified of which alarm and when: at once, repeated, escalated, or not now.

An alarm that has cleared before anybody saw it is notified like one that lasts: short faults, and
those of the night, are the ones that nobody sees. What came and went within a maintenance window is
not, as the work causes it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime

from rigwatch.wire.messages import MOST_ALARMS, Alarm
from rigwatch.witness.people import SEVERITIES, PeopleFile, RecipientSection

SEEN = ("acknowledged", "normal")
"""States of an alarm that somebody has seen or that needs nobody."""
AGAIN_S = 600.0
"""Time after its end in which an alarm that comes again, seen by nobody, is the same one [s]: a
monitor that is restarted again and again would send a notice each time."""


@dataclass(frozen=True, slots=True)
class Notice:
    """One notification.

    Attributes:
        recipient: name of the recipient.
        alarm: the alarm.
        times: how often the recipient was notified of it before.
        minutes: how long it has been unacknowledged [min].
    """

    recipient: str
    alarm: Alarm
    times: int
    minutes: float


@dataclass(slots=True)
class _Unseen:
    """An alarm that nobody has acknowledged, cleared or not.

    Attributes:
        alarm: its last change.
        since: when it came [s].
        ended: when its condition ended [s]; None while it holds.
        told: per recipient the last notice [s] and count.
    """

    alarm: Alarm
    since: float
    ended: float | None = None
    told: dict[str, tuple[float, int]] = field(default_factory=dict)


class Notices:
    """Tracks alarms that nobody has acknowledged; receives the time and reads no clock.

    Args:
        people: recipients and maintenance windows.
    """

    def __init__(self, people: PeopleFile) -> None:
        self.people = people
        self._unseen: dict[str, _Unseen] = {}

    def hear(self, alarm: Alarm, now: float) -> None:
        """Take note of a change of an alarm; `now` is monotonic time [s]."""
        if alarm.state in SEEN:
            self._unseen.pop(alarm.name, None)
            return
        unseen = self._unseen.setdefault(alarm.name, _Unseen(alarm, now))
        if alarm.state == "cleared_unacknowledged":
            unseen.ended = now
        elif unseen.ended is not None and now - unseen.ended > AGAIN_S:
            unseen = self._unseen[alarm.name] = _Unseen(alarm, now)
        else:
            unseen.ended = None
        unseen.alarm = alarm
        if len(self._unseen) > MOST_ALARMS:
            del self._unseen[next(iter(self._unseen))]

    def due(self, now: float, wall: datetime) -> list[Notice]:
        """Notices to send now, each returned once.

        Args:
            now: monotonic time [s].
            wall: the same instant with its time zone, for maintenance windows.
        """
        windows = [one for one in self.people.maintenance if one.holds(wall)]
        found = []
        for name, unseen in list(self._unseen.items()):
            severity = unseen.alarm.severity
            if all(window.lets_through(severity) for window in windows):
                found += [
                    self._notice(unseen, recipient, now)
                    for recipient in self.people.recipients
                    if _is_due(unseen, recipient, now)
                ]
            elif unseen.ended is not None and not unseen.told:
                del self._unseen[name]
        return found

    def _notice(self, unseen: _Unseen, recipient: RecipientSection, now: float) -> Notice:
        times = unseen.told.get(recipient.name, (0.0, 0))[1]
        unseen.told[recipient.name] = now, times + 1
        return Notice(recipient.name, unseen.alarm, times, (now - unseen.since) / 60.0)


def _is_due(unseen: _Unseen, recipient: RecipientSection, now: float) -> bool:
    if SEVERITIES.index(unseen.alarm.severity) < SEVERITIES.index(recipient.lowest):
        return False
    if recipient.name in unseen.told:
        again = recipient.repeat_minutes * 60.0
        return again > 0 and now - unseen.told[recipient.name][0] >= again
    return now - unseen.since >= recipient.after_minutes * 60.0


def by_severity(notices: Iterable[Notice]) -> list[Notice]:
    """The worst first, of these the first."""
    return sorted(notices, key=lambda one: (-SEVERITIES.index(one.alarm.severity), one.alarm.t_ns))
