"""Weak dry friction is noticed soon after it begins, at a motion that was recorded when healthy."""

import numpy as np
import pytest

from monitor.observer import Extremes, decide, new_state
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, TAINTED, WHOLE
from monitor.observer.missing_force import DRY_BARE, DRY_UNIT, JUDGED, VISCOUS_UNIT, E
from rigwatch.wire.arrays import FloatArray

NOISE, PERIOD, BEGIN = 0.05, 32, 1024
WEAK = 3.0 * NOISE
RULES = d.DecisionRules(NOISE, np.zeros(1), 9.0, 5.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 1.6**2)
USUAL = Extremes(lasting=1.4, short=3.3, medium=1.9, friction=4.2, onset=4.2)
"""As a random residual reaches in 20 s."""


def watched(
    force: float, n: int, usual: Extremes = USUAL, late: int = 0, gap: int = 0
) -> FloatArray:
    """The decision's columns where dry friction acts from `BEGIN` on.

    Args:
        force: of dry friction, as what it leaves of the residual.
        n: number of samples.
        usual: of the healthy residual.
        late: phase of the motion at which it begins [samples].
        gap: samples before it that were missing.
    """
    speed = np.sin(2.0 * np.pi * (np.arange(n) + 0.5 + late) / PERIOD)
    judged = np.zeros((n, JUDGED))
    judged[:, DRY_UNIT] = judged[:, DRY_BARE] = -np.sign(speed)
    judged[:, VISCOUS_UNIT] = -speed
    judged[:, E] = NOISE * np.random.default_rng(1).standard_normal(n)
    judged[BEGIN:, E] += force * judged[BEGIN:, DRY_UNIT]
    state = np.full(n, WHOLE)
    state[0], state[BEGIN - gap : BEGIN] = FIRST, TAINTED
    yes, no, out = np.ones(n, np.bool_), np.zeros(n, np.bool_), np.zeros((len(d.OUTPUTS), n))
    decide(
        judged, speed, np.zeros((n, 1)), np.ones(n), yes, no, yes,
        np.tile(np.array(usual)[:, None], n), *np.zeros((2, n)), state, RULES, new_state(1), out,
    )  # fmt: skip
    assert out[d.MODE, BEGIN] == d.JUDGING
    return out


@pytest.mark.parametrize("late", [0, 5, 11, 16, 27])
def test_weak_friction_is_a_departure_within_a_quarter_of_a_period(late: int) -> None:
    departed = np.flatnonzero(watched(WEAK, 2048, late=late)[d.DEPARTED])

    assert BEGIN < departed[0] < BEGIN + PERIOD // 4


def test_it_is_named_within_two_periods() -> None:
    named = np.flatnonzero(watched(WEAK, 2048)[d.VERDICT] == d.FRICTION)

    assert BEGIN < named[0] < BEGIN + 2 * PERIOD


def test_a_random_residual_is_none() -> None:
    out = watched(0.0, 200_000)

    assert not out[d.DEPARTED].any()
    assert out[d.EVIDENCE].max() > USUAL.onset


def test_a_force_that_pushes_is_no_evidence_of_friction() -> None:
    out = watched(-WEAK, 2048)

    assert out[d.EVIDENCE, BEGIN + PERIOD :].max() < USUAL.onset


def test_where_the_healthy_rig_is_not_known_it_has_to_last() -> None:
    unknown = USUAL._replace(onset=np.inf, short=np.inf, medium=np.inf, friction=np.inf)
    departed = np.flatnonzero(watched(WEAK, 2048, unknown)[d.DEPARTED])

    assert departed[0] > BEGIN + PERIOD


def test_after_missing_samples_it_has_to_last() -> None:
    departed = np.flatnonzero(watched(WEAK, 2048, gap=2)[d.DEPARTED])

    assert departed[0] > BEGIN + PERIOD // 2
