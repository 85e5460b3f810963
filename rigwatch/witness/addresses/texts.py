"""Title and text of a message: of one notice, or of many in a flood."""

from collections.abc import Sequence
from datetime import UTC, datetime

from rigwatch.witness.notices import Notice, by_severity


def text_of_all(notices: Sequence[Notice], rig: str) -> tuple[str, str]:
    """Title and text of a message; many notices take a line each, the worst first."""
    if len(notices) == 1:
        return _text_of(notices[0], rig)
    notices = by_severity(notices)
    worst = notices[0].alarm
    title = f"[{rig}] {len(notices)} alarms, {worst.severity}: {worst.name}"
    lines = [f"{_headline(one)}: {one.alarm.cause} ({_when(one)})" for one in notices]
    return title, "\n".join([*lines, "", f"{worst.name}: {worst.guidance}"])


def _text_of(notice: Notice, rig: str) -> tuple[str, str]:
    again = f", notice {notice.times + 1}" if notice.times else ""
    lasting = f", unacknowledged for {notice.minutes:.0f} min" if notice.minutes >= 1 else ""
    title = f"[{rig}] {_headline(notice)}{lasting}{again}"
    return title, f"{notice.alarm.cause}\n\n{notice.alarm.guidance}\n\n{_when(notice)}"


def _headline(notice: Notice) -> str:
    cleared = ", cleared" if notice.alarm.state == "cleared_unacknowledged" else ""
    return f"{notice.alarm.severity}: {notice.alarm.name}{cleared}"


def _when(notice: Notice) -> str:
    return datetime.fromtimestamp(notice.alarm.t_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
