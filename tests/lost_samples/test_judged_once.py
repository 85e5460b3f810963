"""Equations along the motion: what one whole sample shows is not counted again while some lack."""

import numpy as np
import pytest

from monitor.observer import Extremes, decide, new_state
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, TAINTED, WHOLE
from monitor.observer.missing_force import DRY_BARE, DRY_UNIT, JUDGED, VISCOUS_UNIT, E
from rigwatch.wire.arrays import FloatArray, IntArray

NOISE, PERIOD, BEGIN, END = 0.05, 32, 1000, 4000
RULES = d.DecisionRules(NOISE, np.zeros(1), 9.0, 5.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 1.6**2)
USUAL = Extremes(lasting=1.4, short=3.3, medium=1.9, friction=4.2, onset=4.2)
"""As a random residual reaches in 20 s."""
PHASE = 2.0 * np.pi * (np.arange(END) + 0.5) / PERIOD
SPEED, POSITION = np.sin(PHASE), -np.cos(PHASE)
SEEDS = range(30)


def judged(left: FloatArray, state: IntArray, seed: int) -> FloatArray:
    """The decision's columns where a fault leaves a residual from `BEGIN` on."""
    columns = np.zeros((END, JUDGED))
    columns[:, DRY_UNIT] = columns[:, DRY_BARE] = -np.sign(SPEED)
    columns[:, VISCOUS_UNIT] = -SPEED
    columns[:, E] = NOISE * np.random.default_rng(seed).standard_normal(END)
    columns[BEGIN:, E] += left[BEGIN:]
    yes, no, out = np.ones(END, np.bool_), np.zeros(END, np.bool_), np.zeros((len(d.OUTPUTS), END))
    decide(
        columns, SPEED, np.zeros((END, 1)), np.ones(END), yes, no, yes,
        np.tile(np.array(USUAL)[:, None], END), *np.zeros((2, END)), state, RULES, new_state(1),
        out,
    )  # fmt: skip
    return out


def losing(one_in: int) -> IntArray:
    """States of a line that loses one sample in so many, each of which spoils ten kernels; or 0."""
    state = np.full(END, WHOLE)
    place = np.arange(END)
    if one_in:
        state[(place % one_in >= one_in - 10) & (place > 600)] = TAINTED
    state[0] = FIRST
    return state


@pytest.mark.parametrize("one_in", [0, 37, 23, 19])
def test_a_mass_is_not_named_friction_for_what_is_seen_once(one_in: int) -> None:
    """Of a hundred runs one at most: it was named in twenty-five of those that lose one in 19."""
    named = 0
    for seed in range(100):
        verdict = judged(-0.2 * POSITION, losing(one_in), seed)[d.VERDICT]
        named += int((verdict == d.FRICTION).any())
        assert verdict.any()

    assert named <= 1


@pytest.mark.parametrize("one_in", [37, 19, 13])
def test_weak_friction_is_named_on_a_line_that_loses_many_samples(one_in: int) -> None:
    for seed in SEEDS:
        verdict = judged(-3.0 * NOISE * np.sign(SPEED), losing(one_in), seed)[d.VERDICT]
        assert set(np.unique(verdict)) == {d.UNNAMED, d.FRICTION}


def test_a_rig_of_which_no_sample_is_whole_for_long_is_not_watched() -> None:
    state = losing(37)
    state[2000:2600] = TAINTED
    out = judged(np.zeros(END), state, 1)

    assert (out[d.MODE, 1000:2000] == d.JUDGING).all()
    assert (out[d.MODE, 2000 + d.LONG : 2600] == d.ARMING).all()
    assert out[d.MODE, 2600] == d.JUDGING
    assert not out[d.DEPARTED].any()
