"""Alarms: from per-sample conditions to alarms that an operator sees, acknowledges and resets.

The core is pure (`AlarmManager`); only `journal.py` touches a file. One table, `kinds.py`, declares
every alarm with its severity, cause, guidance and default settings.
"""

from monitor.alarms.journal import AlarmJournal, journal_text, read_end, read_journal
from monitor.alarms.kinds import ALARM_KINDS, AlarmKind, check_settings, settings_of
from monitor.alarms.manager import AlarmManager, Announcement
from monitor.alarms.operator import bounded
from monitor.alarms.quality import SensorFlags
from monitor.alarms.record import AlarmRecord, just_returned
from monitor.alarms.state import Occasion
from monitor.alarms.unsaid import unsaid

__all__ = [
    "ALARM_KINDS",
    "AlarmJournal",
    "AlarmKind",
    "AlarmManager",
    "AlarmRecord",
    "Announcement",
    "Occasion",
    "SensorFlags",
    "bounded",
    "check_settings",
    "journal_text",
    "just_returned",
    "read_end",
    "read_journal",
    "settings_of",
    "unsaid",
]
