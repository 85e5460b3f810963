"""Dry friction is told at a motion that no healthy recording has shown; nothing else is."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from monitor.observer import Extremes, decide, high_pass, new_state
from monitor.observer import decision_state as d
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import DRY_BARE, DRY_UNIT, JUDGED, VISCOUS_UNIT, WEAK, E
from rigwatch.wire.arrays import FloatArray

RATE, N, ONSET, FORCE = 256.0, 4096, 2048, 0.7
CORNER = high_pass(2.0, RATE)
RULES = d.DecisionRules(
    0.05, np.zeros(1), 9.0, 4.0, 9.0, 1.0, 0.0, 1.0, 0.01, 256, 192, 2.56, unseen=2.0
)  # fmt: skip


def noise() -> FloatArray:
    """Speed of a motion of many frequencies, rms 1."""
    white = np.random.default_rng(2).standard_normal(N)
    speed = lfilter(*butter(2, [1.0, 8.0], "band", fs=RATE), white)
    return np.asarray(speed / speed.std())


def watched(missing: FloatArray, speed: FloatArray, driven: FloatArray) -> FloatArray:
    """The decision's columns where the motion is never one that was recorded.

    Args:
        missing: force that the equations lack from `ONSET` on.
        speed: of the motion.
        driven: force that is lost with a weaker drive.
    """
    judged = np.zeros((N, JUDGED))
    acts = np.arange(N) >= ONSET
    judged[:, E] = lfilter(*CORNER, np.where(acts, missing, 0.0))
    judged[:, E] += 0.05 * np.random.default_rng(1).standard_normal(N)
    judged[:, DRY_BARE] = -np.sign(speed)
    judged[:, DRY_UNIT] = lfilter(*CORNER, judged[:, DRY_BARE])
    judged[:, VISCOUS_UNIT] = lfilter(*CORNER, -speed)
    judged[:, WEAK] = lfilter(*CORNER, driven)
    state = np.full(N, WHOLE)
    state[0] = FIRST
    yes, no, out = np.ones(N, np.bool_), np.zeros(N, np.bool_), np.zeros((len(d.OUTPUTS), N))
    decide(
        judged, speed, np.zeros((N, 1)), np.ones(N), no, no, yes,
        np.full((len(Extremes._fields), N), np.inf), *np.zeros((2, N)), state, RULES,
        new_state(1), out,
    )  # fmt: skip
    assert (out[d.MODE, 512:] == d.BEYOND).all()
    return out


SPEED = noise()
DRY = -FORCE * np.sign(SPEED)
OTHERS = {
    "viscous": -SPEED,
    "drag": -SPEED * np.abs(SPEED),
    "cubic": -(SPEED**3),
    "root": -np.sign(SPEED) * np.sqrt(np.abs(SPEED)),
    "inertia": -np.gradient(SPEED) * 8.0,
    "spring": -np.cumsum(SPEED) / 8.0,
    "noise": np.random.default_rng(3).standard_normal(N),
    "helping": -DRY,
}


def test_dry_friction_is_named_with_its_force_and_not_before_it_begins() -> None:
    out = watched(DRY, SPEED, np.zeros(N))

    named = np.flatnonzero(out[d.VERDICT] == d.FRICTION)
    assert ONSET < named[0] < ONSET + 4.0 * RATE
    assert (out[d.VERDICT, named[0] :] == d.FRICTION).all()
    assert out[d.NAMED_FORCE, -1] == pytest.approx(FORCE, rel=0.05)
    assert not out[d.DEPARTED].any()


@pytest.mark.parametrize("law", OTHERS)
def test_what_grows_with_the_motion_is_not_called_friction(law: str) -> None:
    out = watched(OTHERS[law], SPEED, np.zeros(N))

    assert (out[d.VERDICT] == d.UNNAMED).all()


def test_what_a_weaker_drive_explains_is_not_called_friction() -> None:
    lost = DRY * (1.0 + 0.6 * np.sin(2.0 * np.pi * 3.0 * np.arange(N) / RATE))

    assert (watched(lost, SPEED, lost)[d.VERDICT] == d.UNNAMED).all()


def test_friction_within_what_a_healthy_rig_may_leave_is_not_named() -> None:
    assert (watched(0.05 * DRY, SPEED, np.zeros(N))[d.VERDICT] == d.UNNAMED).all()


def test_a_motion_that_hardly_reverses_shows_no_friction() -> None:
    speed = np.sin(2.0 * np.pi * 0.5 * (np.arange(N) + 0.3) / RATE)

    out = watched(-FORCE * np.sign(speed), speed, np.zeros(N))

    assert (out[d.VERDICT] == d.UNNAMED).all()


def test_a_tone_does_not_tell_dry_friction_from_what_grows_with_the_motion() -> None:
    speed = np.sin(2.0 * np.pi * 5.0 * (np.arange(N) + 0.3) / RATE)

    out = watched(-FORCE * np.sign(speed), speed, np.zeros(N))

    assert (out[d.VERDICT] == d.UNNAMED).all()
