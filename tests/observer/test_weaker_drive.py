"""A drive that lost part of its voltage in phase with the motion is not dry friction."""

import numpy as np
import pytest

from monitor.observer import Extremes, decide, new_state
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import WHOLE
from monitor.observer.lateness.lateness_state import AGO
from monitor.observer.missing_force import DRY_BARE, DRY_UNIT, JUDGED, VISCOUS_UNIT, WEAK, E

SECONDS, RATE, ONSET, FORCE = 4.0, 256.0, 640, 3.0


def verdict(
    residual: np.ndarray, driven: np.ndarray, speed: np.ndarray, *, late: bool = False
) -> float:
    """The verdict on a residual that begins at `ONSET`, with a drive that acts as `driven`.

    Args:
        residual, driven, speed: shape (n,).
        late: whether the inputs have been late.
    """
    n = speed.size
    judged = np.zeros((n, JUDGED))
    judged[:, E] = 0.05 * np.random.default_rng(1).standard_normal(n)
    judged[ONSET:, E] += residual[ONSET:]
    judged[:, DRY_UNIT], judged[:, VISCOUS_UNIT], judged[:, WEAK] = -np.sign(speed), -speed, driven
    judged[:, DRY_BARE] = judged[:, DRY_UNIT]
    rules = d.DecisionRules(0.05, np.zeros(1), 9.0, 4.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 2.56)
    state, kept = np.full(n, WHOLE), new_state(1)
    if late:
        kept.lateness[AGO] = 0.0
    ones, zeros, out = np.ones(n, np.bool_), np.zeros(n, np.bool_), np.zeros((len(d.OUTPUTS), n))
    decide(
        judged, speed, np.zeros((n, 1)), np.ones(n), ones, zeros, ones,
        np.full((len(Extremes._fields), n), np.inf), *np.zeros((2, n)), state, rules, kept, out,
    )  # fmt: skip
    return float(out[d.VERDICT, -1])


@pytest.mark.parametrize(
    ("in_phase", "expected"), [(True, d.OTHER), (False, d.FRICTION)], ids=["drive", "friction"]
)
def test_a_residual_like_friction_is_called_so_unless_a_weaker_drive_explains_it(
    in_phase: bool, expected: float
) -> None:
    phase = 2.0 * np.pi * 8.0 * np.arange(round(SECONDS * RATE)) / RATE + 0.3
    driven = lost(phase if in_phase else phase + np.pi / 2.0)

    assert verdict(-FORCE * lost(phase), -driven, np.sin(phase)) == expected


@pytest.mark.parametrize(("late", "expected"), [(False, d.FRICTION), (True, d.OTHER)])
def test_beside_late_inputs_more_of_the_force_has_to_be_dry(late: bool, expected: float) -> None:
    speed = np.sin(2.0 * np.pi * 8.0 * np.arange(round(SECONDS * RATE)) / RATE + 0.3)
    # Of what dry friction alone would be, 65 % are left beside viscous friction.
    residual = -FORCE * (np.sign(speed) + 0.845 * speed)

    assert verdict(residual, np.zeros(speed.size), speed, late=late) == expected


def lost(phase: np.ndarray) -> np.ndarray:
    """A force that turns with the phase, more of it in the first half of each half turn."""
    return np.sign(np.sin(phase)) * (1.0 + 0.6 * np.sin(2.0 * phase))
