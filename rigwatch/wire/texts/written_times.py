"""Dates and times of day as loggers write them, in seconds.

2026-03-02 09:00:01.5    2026-03-02T09:00:01Z    02.03.2026 09:00:01,5    3/2/2026 9:00:01 AM
09:00:01.250             26:10:00 (a duration)
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from rigwatch.wire.arrays import FloatArray

DAY = 86400.0
_CLOCK = r"(?P<h>\d{1,4}):(?P<min>\d{2})(?::(?P<s>\d{2}(?:[.,]\d+)?))?\s*(?P<half>[AaPp][Mm])?"
_ZONE = r"(?P<zone>Z|[+-]\d{2}:?\d{2})?"
_FORMS = {
    "clock": re.compile(rf"^{_CLOCK}$"),
    "year first": re.compile(
        rf"^(?P<a>\d{{4}})[-/.](?P<b>\d{{1,2}})[-/.](?P<c>\d{{1,2}})(?:[T\s]+{_CLOCK}{_ZONE})?$"
    ),
    "year last": re.compile(
        rf"^(?P<a>\d{{1,2}})(?P<mark>[-/.])(?P<b>\d{{1,2}})(?P=mark)(?P<c>\d{{4}})(?:[T\s]+{_CLOCK}{_ZONE})?$"
    ),
}


@dataclass(frozen=True, slots=True)
class TimeStyle:
    """How the cells of a column state times.

    Attributes:
        form: "clock", "year first" or "year last".
        month_first: whether the month stands before the day, if the year is last.
    """

    form: str
    month_first: bool = False

    def seconds(self, cell: str) -> float:
        """Seconds since 1970 or midnight.

        Raises:
            ValueError: the cell is written otherwise, or is no date.
        """
        found = _FORMS[self.form].match(cell.strip())
        if found is None:
            raise ValueError(cell)
        parts = found.groupdict()
        clock = _of_day(parts) if parts["h"] else 0.0
        if self.form == "clock":
            return clock
        a, b, c = int(parts["a"]), int(parts["b"]), int(parts["c"])
        year, month, day = (a, b, c) if self.form == "year first" else (c, b, a)
        if self.month_first:
            month, day = day, month
        return datetime(year, month, day, tzinfo=UTC).timestamp() + clock - _ahead(parts["zone"])


def time_style(cells: Iterable[str]) -> TimeStyle | None:
    """The style of a column's times; None if its first cell is no date or time of day.

    With slashes or dashes the month is first unless a cell says otherwise: only a number above 12
    can tell. Within a day both readings give the same steps.
    """
    style: TimeStyle | None = None
    for cell in cells:
        if style is None:
            form = next((form for form, at in _FORMS.items() if at.match(cell.strip())), "")
            if not form:
                return None
            style = TimeStyle(form)
        if style.form != "year last":
            return style
        found = _FORMS[style.form].match(cell.strip())
        if found is None or found["mark"] == "." or int(found["a"]) > 12:
            return style
        if int(found["b"]) > 12:
            break
    return TimeStyle(style.form, month_first=True) if style else None


def past_midnight(seconds: FloatArray) -> FloatArray:
    """Times of day that go on after midnight, shape (n,) [s]."""
    begun = np.cumsum(np.diff(seconds, prepend=seconds[:1]) < -DAY / 2)
    return np.asarray(seconds + DAY * begun)


def _of_day(parts: dict[str, str]) -> float:
    hour, half = int(parts["h"]), (parts["half"] or "").lower()
    if half:
        hour = hour % 12 + (12 if half == "pm" else 0)
    return 3600.0 * hour + 60.0 * int(parts["min"]) + float((parts["s"] or "0").replace(",", "."))


def _ahead(zone: str | None) -> float:
    """Seconds by which a time zone is ahead of UTC."""
    if not zone or zone == "Z":
        return 0.0
    sign = -1.0 if zone[0] == "-" else 1.0
    return sign * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:]))
