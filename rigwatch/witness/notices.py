"""Decides when to notify of an alarm: at once, and again while it is unacknowledged."""

from rigwatch.wire.messages import Alarm
from rigwatch.wire.rig_config import WitnessSection

_SEVERITIES = ("info", "warning", "error", "critical")


class Notices:
    """Tracks notified alarms; receives the time and reads no clock.

    Args:
        settings: section [witness].
    """

    def __init__(self, settings: WitnessSection) -> None:
        self._settings = settings
        self._lowest = _SEVERITIES.index(settings.notify_from)
        self._unseen: dict[str, tuple[Alarm, float]] = {}

    def hear(self, alarm: Alarm, now: float) -> list[Alarm]:
        """Alarms to notify of after a change of one; `now` in seconds."""
        if _SEVERITIES.index(alarm.severity) < self._lowest:
            return []
        if alarm.state != "unacknowledged":
            self._unseen.pop(alarm.name, None)
            return []
        known = alarm.name in self._unseen
        self._unseen[alarm.name] = alarm, self._unseen[alarm.name][1] if known else now
        return [] if known else [alarm]

    def due(self, now: float) -> list[Alarm]:
        """Unacknowledged alarms that are due for another notification."""
        again = self._settings.repeat_minutes * 60.0
        found = [
            alarm for alarm, told in self._unseen.values() if again > 0 and now - told >= again
        ]
        for alarm in found:
            self._unseen[alarm.name] = alarm, now
        return found
