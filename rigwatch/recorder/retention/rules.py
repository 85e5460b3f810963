"""Decides which recordings are removed, by age and total size; those with alarms stay longer."""

from collections.abc import Iterable
from typing import Protocol, TypeVar

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
    found = sorted(recordings, key=lambda one: (one.alarms, one.ended))
    old = [one for one in found if _is_old(one, rules, now_s)]
    excess = kept + sum(one.size for one in found) - sum(one.size for one in old)
    limit = rules.keep_gigabytes * GIGABYTE
    gone = set(map(id, old))
    for one in found:
        if not limit or excess <= limit:
            break
        if id(one) not in gone:
            old.append(one)
            excess -= one.size
    return old


def _is_old(one: Recording, rules: RecorderSection, now_s: float) -> bool:
    days = rules.keep_alarm_days if one.alarms else rules.keep_days
    return days > 0 and now_s - one.ended > days * DAY
