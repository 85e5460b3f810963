"""Decides which recordings are removed, by age and total size; those with alarms stay longer."""

from collections.abc import Iterable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.rig_config import RecorderSection

DAY = 86_400.0
GIGABYTE = 1e9


class Recording(Protocol):
    """A segment or session: its end as Unix time [s], size [bytes], whether it has alarms."""

    @property
    def ended(self) -> float: ...  # noqa: D102

    @property
    def size(self) -> int: ...  # noqa: D102

    @property
    def alarms(self) -> bool: ...  # noqa: D102


R = TypeVar("R", bound=Recording)


class Facts(NamedTuple):
    """The same of several recordings, in arrays."""

    ended: FloatArray
    size: IntArray
    alarms: BoolArray


def expired(
    recordings: Iterable[R], rules: RecorderSection, now_s: float, kept: int = 0
) -> list[R]:
    """Recordings to be removed, oldest first, those without alarms before those with alarms.

    Args:
        recordings: of one rig, without the one that is being written.
        rules: `keep_days`, `keep_alarm_days` and `keep_gigabytes`; 0 disables a limit.
        now_s: Unix time [s].
        kept: size that counts and is not among them: of what is being written, and room for what
            comes before the next check [bytes].
    """
    found = [*recordings]
    facts = Facts(
        np.array([one.ended for one in found], np.float64),
        np.array([one.size for one in found], np.int64),
        np.array([one.alarms for one in found], np.bool_),
    )
    return [found[place] for place in places_expired(facts, rules, now_s, kept)]


def places_expired(facts: Facts, rules: RecorderSection, now_s: float, kept: int = 0) -> list[int]:
    """The same for recordings of which only what decides is known: their places."""
    order = np.lexsort((facts.ended, facts.alarms))
    ended, size, alarms = (one[order] for one in facts)
    days = np.where(alarms, rules.keep_alarm_days, rules.keep_days)
    old = (days > 0) & (now_s - ended > days * DAY)
    excess = kept + int(size[~old].sum()) - rules.keep_gigabytes * GIGABYTE
    gone: list[int] = order[old].tolist()
    if rules.keep_gigabytes and excess > 0:
        left = order[~old]
        enough = np.searchsorted(np.cumsum(size[~old]), excess)
        gone += left[: int(enough) + 1].tolist()
    return gone
