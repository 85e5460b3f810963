"""Alarms and gaps as lines of a log."""

import math

from rigwatch.dashboard.board.alarm_book import title
from rigwatch.dashboard.board.palette import STATES
from rigwatch.wire.messages import Alarm, Gap, Severity

LEVELS: dict[Severity, str] = {
    "info": "INFO",
    "warning": "WARN",
    "error": "ERROR",
    "critical": "CRITICAL",
}


def alarm_level(alarm: Alarm) -> str:
    """Level of an alarm's line: its severity until acknowledged, information after."""
    return LEVELS[alarm.severity] if alarm.state == "unacknowledged" else "INFO"


def alarm_line(alarm: Alarm) -> str:
    """What happened, the probable cause, what to do, and the deciding figure."""
    label = STATES[alarm.state][0]
    head = f"{title(alarm.name)}: {label}{f' by {alarm.user}' if alarm.user else ''}"
    if alarm.state != "unacknowledged":
        return head
    return " — ".join(part for part in (head, alarm.guidance, alarm.cause, _why(alarm)) if part)


def _why(alarm: Alarm) -> str:
    parts = []
    if math.isfinite(alarm.value):
        parts.append(f"value {alarm.value:.3g}")
    if math.isfinite(alarm.low):
        parts.append(f"above {alarm.low:.3g} expected")
    if math.isfinite(alarm.high):
        parts.append(f"below {alarm.high:.3g} expected")
    if alarm.seq >= 0:
        parts.append(f"sample {alarm.seq}")
    return ", ".join(parts)


def gap_line(gap: Gap) -> str:
    """The number of missing samples or messages, if known."""
    what, lost = gap.topic or "samples", gap.last - gap.first + 1
    many = f"{lost} {what} lost from {gap.first} on" if lost > 0 else f"{what} lost, number unknown"
    return f"{gap.reporter}: {gap.device}: {many}: {gap.reason}"
