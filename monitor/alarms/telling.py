"""How an alarm tells its value, and when a standing one tells it again.

A force is known roughly when friction is named, and better once the motion has reversed some more;
or it grows. The alarm then tells it again: the same alarm in the same state, which nobody is called
for. To say each change would fill the journal of a rig that runs on for weeks, so the alarm's age
at least doubles from one telling to the next.
"""

import numpy as np

from monitor.alarms.state import AlarmInstance
from monitor.signals import Condition
from rigwatch.wire.arrays import IntArray

FIRST_NS = 250_000_000
"""Age at which a value may be told again for the first time [ns]."""
CHANGED = 0.05
"""Change of the value, relative to the one that was told, that is worth it."""


def figure_of(condition: Condition, index: int) -> str:
    """The value of a condition at a sample in words; "" if it does not tell it, or is not known."""
    value = float(condition.value[index])
    return condition.told.format(value) if np.isfinite(value) and value != 0.0 else ""


def next_telling(alarm: AlarmInstance, condition: Condition, t_ns: IntArray) -> int | None:
    """Index of the first sample at which the alarm tells its value again; None if none.

    Args:
        alarm: stands, and nobody has acknowledged it.
        condition: its own, over samples at `t_ns`.
        t_ns: shape (n,) [ns].
    """
    told = alarm.occasion
    age = max(FIRST_NS, 2 * (told.t_ns - alarm.since_ns))
    due = (t_ns >= alarm.since_ns + age) & (condition.active != 0)
    changed = np.abs(condition.value - told.value) > CHANGED * abs(told.value)
    found = np.flatnonzero(due & changed)
    return int(found[0]) if found.size else None
