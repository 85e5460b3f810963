"""The judgement of each sample, before the alarms add persistence and latching.

A condition is a column: one flag per sample, with the judged value and its limits. Nothing is
delayed, held or latched here; `monitor.alarms` does that.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

DEPARTURE = "departure"
DRY_FRICTION = "dry_friction"
STICTION = "stiction"
OTHER_FAULT = "other_fault"
EXCITATION_CHANGED = "excitation_changed"
REFERENCE_LEARNT = "reference_learnt"
SENSOR_JUMPED = "sensor_jumped"
"""One a channel that shows a state of the model, as `sensor_jumped.position`."""
NOT_OBSERVABLE = "not_observable"
ILL_CONDITIONED = "ill_conditioned"
NOT_ARMED = "not_armed"
NOT_JUDGED = "not_judged"
DRIVE_LATE = "drive_late"
GAP = "gap"
MONITOR_RESET = "monitor_reset"
SENSOR_INVALID = "sensor_invalid"
SENSOR_CLIPPED = "sensor_clipped"
"""One per channel, as `sensor_clipped.position`; its value is the evidence S of `flat_top.py`."""


@dataclass(frozen=True)
class ConditionKind:
    """One kind of condition: its name, the meaning and unit of `value`, and its description."""

    name: str
    value: str
    unit: str
    meaning: str
    is_fault: bool


CONDITION_KINDS: tuple[ConditionKind, ...] = (
    ConditionKind(
        DEPARTURE,
        "largest deviation from the healthy rig, in standard deviations",
        "1",
        "an estimate or a residual exceeds its thresholds",
        True,
    ),
    ConditionKind(
        DRY_FRICTION,
        "Coulomb estimate theta1 as a share of its signature",
        "1",
        "the change follows the signature of dry friction",
        True,
    ),
    ConditionKind(
        STICTION,
        "share of the time at rest in the window",
        "1",
        "the mass stands still where the model moves it",
        True,
    ),
    ConditionKind(
        OTHER_FAULT,
        "share of the change that friction explains",
        "1",
        "the rig has changed and dry friction does not explain how",
        True,
    ),
    ConditionKind(
        EXCITATION_CHANGED,
        "deviation of the excitation from the one that was armed with",
        "1",
        "the excitation is another one, the healthy reference no longer holds",
        False,
    ),
    ConditionKind(
        REFERENCE_LEARNT,
        "length of the stretch of this run that counts as healthy",
        "s",
        "healthy is what this run began with, not what commissioning found",
        False,
    ),
    ConditionKind(
        NOT_OBSERVABLE,
        "velocity, root mean square over the window",
        "m/s",
        "too little motion to estimate friction, estimates are frozen",
        False,
    ),
    ConditionKind(
        ILL_CONDITIONED,
        "condition number of the normal matrix",
        "1",
        "the two friction terms cannot be told apart, estimates are held",
        False,
    ),
    ConditionKind(
        GAP,
        "samples missing before this one",
        "1",
        "samples are missing before this one",
        False,
    ),
    ConditionKind(
        MONITOR_RESET,
        "1 where the filters were reset",
        "1",
        "a filter diverged (NaN or out of range) and was reset",
        True,
    ),
    ConditionKind(
        SENSOR_INVALID,
        "samples in a row without a valid reading of a channel that the residual needs",
        "1",
        "a channel has been invalid for longer than can be predicted through",
        True,
    ),
)


class Condition(NamedTuple):
    """One condition over a block of n samples.

    Args:
        name: one of `CONDITION_KINDS`, or SENSOR_CLIPPED or SENSOR_JUMPED with its channel.
        active: 1 where the condition holds, shape (n,).
        value: the judged quantity, shape (n,), in the kind's unit; NaN if not judged.
        low: lower limit of `value`, shape (n,); -inf if there is none.
        high: upper limit of `value`, shape (n,); +inf if there is none.
        told: how its alarm tells `value`, such as "{:.3g} N of friction", and tells it again where
            it has become better; "" if it does not.
    """

    name: str
    active: NDArray[np.uint8]
    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    told: str = ""


def above(
    name: str,
    active: NDArray[np.bool_],
    value: NDArray[np.float64],
    high: float,
    *,
    told: str = "",
) -> Condition:
    """A condition that holds above an upper limit; its arrays are read only."""
    low, limit = level(active.size, -np.inf), level(active.size, float(high))
    return Condition(name, active.view(np.uint8), value, low, limit, told)


def below(
    name: str, active: NDArray[np.bool_], value: NDArray[np.float64], low: float
) -> Condition:
    """A condition that holds below a lower limit; its arrays are read only."""
    n = active.size
    return Condition(name, active.view(np.uint8), value, level(n, float(low)), level(n, np.inf))


@lru_cache(maxsize=1024)
def level(n: int, value: float) -> NDArray[np.float64]:
    """The same limit for n samples, read only: blocks of a rig have few lengths and limits."""
    found = np.full(n, value)
    found.setflags(write=False)
    return found
