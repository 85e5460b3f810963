"""The file of people: who is notified of alarms, when, and when nobody is.

A separate file, as addresses hold passwords and the rig's configuration is stored in recordings.
"""

from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, field

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import WitnessSection
from rigwatch.wire.typed_files import Section, load

Severity = Literal["info", "warning", "error", "critical"]
Day = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
_DAYS: tuple[Day, ...] = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
SEVERITIES: tuple[Severity, ...] = ("info", "warning", "error", "critical")
MOST_RECIPIENTS = 32


class RecipientSection(Section, frozen=True):
    """[[recipients]] — one person, group or program that is notified."""

    name: Annotated[str, Meta(min_length=1, description="name in messages and figures")]
    url: Annotated[
        str,
        Meta(
            description="address in Apprise's notation: mailtos:// (e-mail), json:// (webhook) and "
            "others; needs `rigwatch[notify]`"
        ),
    ] = ""
    command: Annotated[
        tuple[str, ...],
        Meta(
            description="command run instead, with name, severity and cause as arguments and the "
            "alarm as JSON on standard input"
        ),
    ] = ()
    lowest: Annotated[Severity, Meta(description="lowest severity that is notified")] = "error"
    after_minutes: Annotated[
        float,
        Meta(
            ge=0, description="time that an alarm stands unacknowledged before (escalation) [min]"
        ),
    ] = 0.0
    repeat_minutes: Annotated[
        float, Meta(ge=0, description="interval of repeats until acknowledged [min]; 0 for never")
    ] = 0.0


class MaintenanceSection(Section, frozen=True):
    """[[maintenance]] — a time in which nobody is notified; alarms are raised as always.

    Either once, from `begin` to `end`, or on `days` of each week at the local time `at` for
    `minutes`. An alarm that still stands unacknowledged at the end is notified then.
    """

    name: Annotated[str, Meta(min_length=1, description="what is done")]
    begin: Annotated[datetime | None, Meta(description="begin, once")] = None
    end: Annotated[datetime | None, Meta(description="end, once")] = None
    days: Annotated[tuple[Day, ...], Meta(description="days of the week")] = ()
    at: Annotated[time | None, Meta(description="local time of begin on these days")] = None
    minutes: Annotated[float, Meta(ge=0, le=1440, description="duration on these days [min]")] = 0.0
    still: Annotated[
        Severity | None, Meta(description="lowest severity that is notified nevertheless")
    ] = None

    def holds(self, now: datetime) -> bool:
        """Whether it is the time of this window; `now` has a time zone."""
        if self.begin and self.end:
            return _aware(self.begin) <= now < _aware(self.end)
        local = now.astimezone()
        return any(
            self._on(local.date() - timedelta(days=ago), local) for ago in (0, 1) if self.days
        )

    def _on(self, day: date, local: datetime) -> bool:
        if self.at is None or _DAYS[day.weekday()] not in self.days:
            return False
        begin = datetime.combine(day, self.at).astimezone()
        return begin <= local < begin + timedelta(minutes=self.minutes)

    def lets_through(self, severity: Severity) -> bool:
        """Whether alarms of this severity are notified in this window."""
        return self.still is not None and SEVERITIES.index(severity) >= SEVERITIES.index(self.still)


class PeopleFile(Section, frozen=True):
    """The file of people."""

    recipients: Annotated[
        tuple[RecipientSection, ...],
        Meta(max_length=MOST_RECIPIENTS, description="who is notified"),
    ] = ()
    maintenance: Annotated[
        tuple[MaintenanceSection, ...], Meta(description="when nobody is notified")
    ] = field(default=())


def load_people(settings: WitnessSection) -> PeopleFile:
    """Recipients and maintenance windows: the file's, and the command of section [witness].

    Raises:
        ConfigError: the file is invalid.
    """
    people = load(settings.people, PeopleFile) if settings.people else PeopleFile()
    check_people(people, Path(settings.people))
    if not settings.notify:
        return people
    own = RecipientSection(
        name="command",
        command=settings.notify,
        lowest=settings.notify_from,
        repeat_minutes=settings.repeat_minutes,
    )
    return PeopleFile(recipients=(own, *people.recipients), maintenance=people.maintenance)


def check_people(people: PeopleFile, file: Path) -> None:
    """Check what types cannot express.

    Raises:
        ConfigError: an entry is contradictory.
    """
    names = [one.name for one in people.recipients]
    if len(set(names)) < len(names):
        raise ConfigError(file, "recipients", f"the names {', '.join(names)}", "different names")
    for one in people.recipients:
        if bool(one.url) == bool(one.command):
            key = f"recipients.{one.name}"
            found = "both url and command" if one.url else "neither url nor command"
            raise ConfigError(file, key, found, "one of them")
    for window in people.maintenance:
        once, weekly = window.begin and window.end, window.days and window.at and window.minutes
        if bool(once) == bool(weekly):
            key = f"maintenance.{window.name}"
            raise ConfigError(file, key, "no time or two", "begin and end, or days, at and minutes")


def _aware(when: datetime) -> datetime:
    """A time without zone is local."""
    return when.astimezone(UTC)
