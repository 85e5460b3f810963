"""Conditions and blocks for the alarm tests, and the manager driven over them in any cut."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from monitor.alarms import AlarmManager, AlarmRecord, Announcement
from monitor.signals.conditions import Condition
from rigwatch.wire.messages.message_types import Alarm, AlarmCommand, Event

PERIOD_NS = 3_906_250
START_NS = 1_700_000_000_000_000_000


def condition(name: str, active: Sequence[int] | np.ndarray) -> Condition:
    """A condition whose value is its place, between limits -1 and 1."""
    flags = np.asarray(active, np.uint8)
    place = np.arange(len(flags), dtype=float)
    one = np.ones(len(flags))
    return Condition(name, flags, place, -one, one)


def newest(records: Iterable[AlarmRecord]) -> list[AlarmRecord]:
    """The newest record of each alarm, which a restarted monitor restores."""
    return list({record.alarm.name: record for record in records}.values())


def spell(n: int, *stretches: tuple[int, int]) -> np.ndarray:
    """Flags of n samples, set over each stretch (first, one past the last)."""
    flags = np.zeros(n, np.uint8)
    for first, last in stretches:
        flags[first:last] = 1
    return flags


def time_of(seq: int) -> int:
    return START_NS + seq * PERIOD_NS


def times(n: int, first: int = 0) -> np.ndarray:
    """Times of n samples from sample `first` on [ns]."""
    return START_NS + PERIOD_NS * np.arange(first, first + n, dtype=np.int64)


def _cut(one: Condition, first: int, last: int) -> Condition:
    part = slice(first, last)
    return one._replace(
        active=one.active[part], value=one.value[part], low=one.low[part], high=one.high[part]
    )


def run(
    manager: AlarmManager, conditions: Sequence[Condition], cuts: Iterable[int] = ()
) -> list[Announcement]:
    """What the manager says to samples 0 to n - 1, cut into blocks at `cuts`."""
    n = len(conditions[0].active)
    said: list[Announcement] = []
    edges = sorted({0, n, *(cut for cut in cuts if 0 < cut < n)})
    for first, last in pairwise(edges):
        t_ns = times(last - first, first)
        parts = [_cut(one, first, last) for one in conditions]
        said += manager.update("rig", 7, first, t_ns, parts)
    return said


def steps(said: Iterable[Announcement]) -> list[tuple[str, str, int]]:
    """Alarms as (name, state, seq)."""
    return [(one.name, one.state, one.seq) for one in said if isinstance(one, Alarm)]


def codes(said: Iterable[Announcement]) -> list[str]:
    return [one.code for one in said if isinstance(one, Event)]


def order(
    name: str, action: str, user: str = "ann", at: int = 5000, text: str = ""
) -> AlarmCommand:
    return AlarmCommand(name, action, user, time_of(at), text)
