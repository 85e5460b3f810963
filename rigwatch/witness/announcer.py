"""Notifies people: follows the file of people, decides who is due, and hands over to delivery."""

from datetime import UTC, datetime
from pathlib import Path

from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import Alarm
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.witness.delivery import Delivery
from rigwatch.witness.notices import SEEN, Notices
from rigwatch.witness.people import load_people

BETWEEN_LOOKS = 2.0
"""Time between two checks whether the file of people has changed [s]."""


class Announcer:
    """Notifications of one rig.

    Args:
        settings: section [witness].
        rig: id of the rig.

    Raises:
        ConfigError: the file of people is invalid.
        MissingExtraError: it holds addresses, and apprise is not installed.
    """

    def __init__(self, settings: WitnessSection, rig: str) -> None:
        self._settings = settings
        self._file = Path(settings.people)
        self._stamp = self._stamped()
        people = load_people(settings)
        self._notices = Notices(people)
        self._delivery = Delivery(rig, self._file)
        self._delivery.use(people)
        self._file_trouble = ""
        self._looked_at = float("-inf")

    def hear(self, alarm: Alarm, now: float) -> None:
        """Take note of a change of an alarm; `now` is monotonic time [s]."""
        self._notices.hear(alarm, now)
        if alarm.state in SEEN:
            self._delivery.withdraw(alarm.name)

    def turn(self, now: float, t_ns: int) -> None:
        """Queue what is due; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        if now - self._looked_at >= BETWEEN_LOOKS:
            self._looked_at = now
            self._follow_file()
        self._delivery.send(self._notices.due(now, datetime.fromtimestamp(t_ns / 1e9, UTC)))

    @property
    def counters(self) -> dict[str, float]:
        """Figures for the health message."""
        return self._delivery.counters

    @property
    def trouble(self) -> str:
        """What is wrong, in one line; "" if nothing is."""
        return self._file_trouble or self._delivery.trouble

    def _follow_file(self) -> None:
        """Read the file again if it has changed; a wrong one changes nothing."""
        if (stamp := self._stamped()) == self._stamp:
            return
        self._stamp = stamp
        try:
            people = load_people(self._settings)
            self._delivery.use(people)
        except RigwatchError as error:
            self._file_trouble = f"{error}; the recipients remain as they were"
            return
        self._notices.people, self._file_trouble = people, ""

    def _stamped(self) -> tuple[int, int, int] | None:
        """Changes whenever the file does."""
        try:
            found = self._file.stat() if self._settings.people else None
        except OSError:
            return None
        return (found.st_mtime_ns, found.st_size, found.st_ino) if found else None
