"""Friction changes the motion; what equations mispredict of the change does not hide its force.

A mass with a damper is driven by a sine. Equations that lack part of the damping, and have as much
less of the drive's force, describe the healthy rig at this motion, and not one that rubs: of one
motion, what depends on the speed is not told from what depends on the drive.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from monitor.observer import Extremes, decide, new_state
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import DRY_BARE, DRY_UNIT, JUDGED, PREDICTED, VISCOUS_UNIT, E
from monitor.observer.remainder_terms import information_of
from rigwatch.wire.arrays import FloatArray

RATE, PERIOD, STEPS = 256.0, 32, 32
MASS, DAMPING, DRIVE, NOISE = 0.3, 6.0, 5.0, 0.15
BEGIN, END = 1024, 2048
RULES = d.DecisionRules(NOISE, np.zeros(1), 9.0, 5.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 1.6**2)
USUAL = Extremes(lasting=1.4, short=3.3, medium=1.9, friction=4.2, onset=4.2)


def speed_of(friction: float) -> FloatArray:
    """Speed of the mass, which rubs with `friction` [N] from `BEGIN` on, shape (END,)."""
    found, speed, step = np.zeros(END), 0.0, 1.0 / RATE / STEPS
    for k in range(END * STEPS):
        if k % STEPS == 0:
            found[k // STEPS] = speed
        rubs = friction * np.tanh(speed / 1e-3) if k >= BEGIN * STEPS else 0.0
        force = DRIVE * np.sin(2.0 * np.pi * k / (PERIOD * STEPS)) - DAMPING * speed - rubs
        speed += step * force / MASS
    return found


@dataclass(frozen=True)
class Rig:
    """A rig that rubs with `friction` [N], and what is wrong with its equations.

    Attributes:
        friction: of the rig [N].
        mistaken: damping that the equations lack [N s/m].
        rounded: speed over which the residual's friction changes sign [m/s].
    """

    friction: float
    mistaken: float
    rounded: float = 1e-3


def terms_of(speed: FloatArray) -> FloatArray:
    """What the residual may depend on: the speed, and the drive in and out of phase."""
    phase = 2.0 * np.pi * np.arange(END) / PERIOD
    columns = np.column_stack([speed, np.sin(phase), np.cos(phase)])
    return np.asarray(columns / np.std(columns, axis=0))


def told(rig: Rig, information: FloatArray) -> float:
    """The force that is told last [N]."""
    speed, healthy = speed_of(rig.friction), speed_of(0.0)
    judged = np.zeros((END, JUDGED))
    judged[:, DRY_UNIT] = judged[:, DRY_BARE] = -np.sign(speed) / MASS
    judged[:, VISCOUS_UNIT] = -speed / MASS
    judged[BEGIN:, E] = -rig.friction * np.tanh(speed[BEGIN:] / rig.rounded) / MASS
    judged[:, E] -= rig.mistaken * (speed - healthy) / MASS
    judged[:, PREDICTED] = np.gradient(speed, 1.0 / RATE) - judged[:, E]
    judged[:, E] += NOISE * np.random.default_rng(1).standard_normal(END)
    state = np.full(END, WHOLE)
    state[0] = FIRST
    yes, no, out = np.ones(END, np.bool_), np.zeros(END, np.bool_), np.zeros((len(d.OUTPUTS), END))
    count = len(information)
    levels = np.hstack([np.zeros((END, 1)), terms_of(speed)[:, :count]])
    decide(
        judged, speed, levels, np.ones(END), yes, no, yes,
        np.tile(np.array(USUAL)[:, None], END), *np.zeros((2, END)), state,
        RULES._replace(information=information), new_state(1, count), out,
    )  # fmt: skip
    assert out[d.VERDICT, -1] == d.FRICTION
    return float(out[d.NAMED_FORCE, -1])


def learnt() -> FloatArray:
    """The information that the healthy motion gives of the terms' weights."""
    left = 3.0 * NOISE * np.random.default_rng(2).standard_normal(END)
    root = np.zeros((3, 3))
    root[np.triu_indices(3)] = information_of(terms_of(speed_of(0.0)), left, left)
    return np.asarray(root.T @ root)


@pytest.mark.parametrize(
    ("friction", "mistaken"), [(0.3, 4.0), (0.6, 4.0), (0.9, 4.0), (0.6, -2.0), (0.9, -2.0)]
)
def test_a_change_of_the_motion_that_the_equations_do_not_follow_leaves_the_force(
    friction: float, mistaken: float
) -> None:
    rig = Rig(friction, mistaken)
    alone = told(rig, np.zeros((0, 0)))

    assert abs(alone - friction) > 0.06 * friction
    assert told(rig, learnt()) == pytest.approx(friction, rel=0.06)


@pytest.mark.parametrize("friction", [0.3, 0.6, 0.9])
def test_equations_that_follow_it_leave_the_force(friction: float) -> None:
    assert told(Rig(friction, mistaken=0.0), learnt()) == pytest.approx(friction, rel=0.06)


@pytest.mark.parametrize(("rounded", "within"), [(0.02, 0.05), (0.05, 0.05), (0.1, 0.3)])
def test_what_is_rounded_where_the_motion_reverses_is_not_taken_for_another_term(
    rounded: float, within: float
) -> None:
    assert told(Rig(0.6, 0.0, rounded), learnt()) == pytest.approx(0.6, rel=within)


def test_without_the_information_the_force_is_that_of_friction_alone() -> None:
    speed = speed_of(0.6)
    alone = told(Rig(0.6, mistaken=4.0), np.zeros((0, 0)))

    dry, error = np.sign(speed[-128:]), 0.6 * np.sign(speed[-128:])
    error += 4.0 * (speed - speed_of(0.0))[-128:]
    assert alone == pytest.approx(float(dry @ error) / 128.0, rel=0.06)
