"""The content of the dashboard: plots, alarm lanes, status text, layout."""

from rigwatch.dashboard.board import entities, palette
from rigwatch.dashboard.board.alarm_book import NAMED_FAULTS, is_active
from rigwatch.dashboard.board.board import APPLICATION, SET_BACK_NS, Dashboard
from rigwatch.dashboard.board.facts import Facts
from rigwatch.dashboard.board.layout import Windows, screen

__all__ = [
    "APPLICATION",
    "NAMED_FAULTS",
    "SET_BACK_NS",
    "Dashboard",
    "Facts",
    "Windows",
    "entities",
    "is_active",
    "palette",
    "screen",
]
