"""Where each condition of the friction scheme holds, from the outputs of its kernel."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.decision import kernel_state as w
from monitor.decision import rules_for
from monitor.model import RigModel
from monitor.signals import conditions as kinds
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel

JUDGED: tuple[tuple[str, int], ...] = (
    (kinds.DEPARTURE, w.DEVIATION),
    (kinds.DRY_FRICTION, w.THETA1),
    (kinds.STICTION, w.REST),
    (kinds.OTHER_FAULT, w.EXPLAINED),
    (kinds.EXCITATION_CHANGED, w.MOVED_VOLTAGE),
    (kinds.REFERENCE_LEARNT, -1),
    (kinds.NOT_OBSERVABLE, w.SPEED_RMS),
    (kinds.ILL_CONDITIONED, w.CONDITION),
    (kinds.GAP, -1),
    (kinds.SENSOR_INVALID, -1),
)
"""Conditions, each with the output that is judged; -1 if it is not one alone."""
(
    _DEPARTED, _RUBS, _STICKS, _OTHER, _EXCITED,
    LEARNT, _STANDS, _ILL, MISSING, INVALID,
) = range(len(JUDGED))  # fmt: skip
_HIGH = {_STICKS: 0.5, _OTHER: np.inf, _EXCITED: 0.1, _STANDS: np.inf}
"""Upper limits that no rule of the model gives; 0 for the others."""


class Flagging(NamedTuple):
    """Limits of the conditions."""

    longest_hold: int
    factor: float
    least_velocity: float
    worst_condition: float


def flagging_of(model: RigModel) -> Flagging:
    """The limits that a model gives."""
    decision = model.decision
    return Flagging(
        decision.longest_hold,
        float(rules_for(model).factor),
        float(decision.least_velocity),
        float(decision.worst_condition),
    )


def judged_by(model: RigModel) -> tuple[tuple[str, int, float, float], ...]:
    """The conditions `JUDGED`, each with its lower and upper limit."""
    limits = flagging_of(model)
    low = {_STANDS: limits.least_velocity}
    high = _HIGH | {
        _DEPARTED: limits.factor,
        _ILL: limits.worst_condition,
        INVALID: limits.longest_hold,
    }
    return tuple(
        (name, k, float(low.get(row, -np.inf)), float(high.get(row, 0.0)))
        for row, (name, k) in enumerate(JUDGED)
    )


@kernel()
def flag(
    out: FloatArray,
    run: NDArray[np.int64],
    missing: int,
    limits: Flagging,
    flags: NDArray[np.uint8],
) -> None:
    """Where each of the conditions `JUDGED` holds, shape (conditions, n)."""
    for i in range(out.shape[1]):
        armed, verdict = out[w.ARMED_FLAG, i] > 0.0, out[w.VERDICT, i]
        sticks = verdict == w.STICKING
        flags[_DEPARTED, i] = armed and out[w.DEVIATION, i] > limits.factor
        flags[_RUBS, i] = armed and (sticks or verdict == w.FRICTION)
        flags[_STICKS, i] = armed and sticks
        flags[_OTHER, i] = armed and verdict == w.OTHER
        flags[_EXCITED, i] = armed and verdict == w.NEW_EXCITATION
        flags[LEARNT, i] = armed and out[w.LEARNT_HERE, i] > 0.0
        flags[_STANDS, i] = armed and not out[w.SPEED_RMS, i] >= limits.least_velocity
        flags[_ILL, i] = armed and out[w.CONDITION, i] > limits.worst_condition
        flags[MISSING, i] = i == 0 and missing != 0
        flags[INVALID, i] = run[i] > limits.longest_hold
