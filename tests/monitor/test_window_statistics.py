"""Friction from the last samples: in newtons although contacts deform before they slide."""

import numpy as np
import pytest
from scipy.signal import lfilter

from monitor.observer.decision import told_force, window_statistics
from monitor.observer.decision.decision_state import (
    AT,
    BARE,
    DELAYED,
    DRY,
    ERROR,
    HISTORY,
    PASSED,
    SHORT,
    SPEED,
    WET,
    DecisionState,
    new_state,
)
from monitor.observer.missing_force import high_pass
from rigwatch.wire.arrays import FloatArray
from tests.compiled import from_python

dry_force = from_python(told_force.dry_force)
friction = from_python(window_statistics.friction)
onset_evidence = from_python(window_statistics.onset_evidence)

FORCE, LENGTH = 0.6, 64


def swinging(period: int = 32) -> DecisionState:
    """Rows of a motion that reverses every half period [samples]."""
    speed = np.sin(2.0 * np.pi * (np.arange(HISTORY) + 0.3) / period)
    kept = new_state(1)
    kept.rows[:, SPEED], kept.rows[:, WET], kept.rows[:, BARE] = speed, -speed, -np.sign(speed)
    kept.counts[AT.filled] = HISTORY
    return kept


def turning(late: int) -> DecisionState:
    """Dry friction that turns so many samples after the speed as it is measured."""
    kept = swinging()
    kept.rows[:, DRY] = kept.rows[:, BARE]
    kept.rows[:, ERROR] = FORCE * np.roll(kept.rows[:, DRY], late)
    return kept


@pytest.mark.parametrize("late", [0, 1, 2])
def test_force_does_not_fall_with_samples_in_which_friction_turns(late: int) -> None:
    kept = turning(late)
    assert dry_force(kept, LENGTH, LENGTH, PASSED)[0] == pytest.approx(FORCE, rel=1e-6)


@pytest.mark.parametrize("late", [-1, 0, 1, 2])
def test_friction_is_told_from_viscous_friction_wherever_it_turns(late: int) -> None:
    force, viscous, _, share, _ = friction(turning(late), LENGTH, 1e-3)

    assert force == pytest.approx(FORCE, rel=1e-6)
    assert viscous == pytest.approx(0.0, abs=1e-6)
    assert share == pytest.approx(1.0, abs=1e-3)


def begins(begun: int, period: int) -> tuple[DecisionState, FloatArray]:
    """Dry friction in the newest samples, after a healthy motion, and the high-pass."""
    kept = swinging(period)
    corner = np.array(high_pass(2.0, 256.0))
    bare = kept.rows[:, BARE]
    always = np.concatenate([np.tile(bare[:period], 8), bare])
    kept.rows[:, DRY] = lfilter(*corner, always)[-HISTORY:]
    acts = np.arange(HISTORY) >= HISTORY - begun
    kept.rows[:, ERROR] = FORCE * lfilter(*corner, np.where(acts, bare, 0.0))
    return kept, corner


@pytest.mark.parametrize("begun", [20, 32, 44])
def test_friction_that_has_just_begun_is_not_told_half_as_large(begun: int) -> None:
    kept, corner = begins(begun, 32)

    _, acting = dry_force(kept, begun - 4, LENGTH, corner)

    assert acting == pytest.approx(FORCE, rel=0.05)


@pytest.mark.parametrize("noticed", [0, 2, 4])
@pytest.mark.parametrize("before", [2, 3, 5])
def test_friction_that_begins_shortly_before_a_slow_reversal_has_its_force(
    before: int, noticed: int
) -> None:
    slow, since_reversal = 76, 16
    begun = before + since_reversal
    kept, corner = begins(begun, slow)

    _, acting = dry_force(kept, begun - noticed, begun - noticed + SHORT, corner)

    assert acting == pytest.approx(FORCE, rel=0.05)


def test_a_motion_that_turns_at_every_sample_shows_no_friction() -> None:
    kept = new_state(1)
    kept.rows[::2, SPEED], kept.rows[1::2, SPEED] = 1.0, -1.0
    kept.rows[:, DRY], kept.rows[:, ERROR] = 1.0, 1.0
    kept.counts[AT.filled] = HISTORY

    assert friction(kept, LENGTH, 1e-3) == (0.0, 0.0, 0.0, 0.0, 0.0)


def begun(column: int) -> DecisionState:
    """A residual that has been for 12 samples the response in a column.

    Friction and later inputs have responses that are alike.
    """
    kept = swinging()
    kept.rows[:, DELAYED] = -kept.rows[:, SPEED]
    kept.rows[-12:, ERROR] = 0.5 * kept.rows[-12:, column]
    return kept


@pytest.mark.parametrize(
    ("column", "jumps", "shows"),
    [(BARE, False, True), (BARE, True, True), (DELAYED, False, True), (DELAYED, True, False)],
)
def test_an_onset_of_friction_is_told_from_a_jump_of_the_lateness(
    column: int, jumps: bool, shows: bool
) -> None:
    assert (onset_evidence(begun(column), 0.05, 0.0, jumps) > 6.7) == shows


def test_what_an_unknown_lateness_may_leave_is_no_onset() -> None:
    kept = begun(DELAYED)

    assert onset_evidence(kept, 0.05, 0.5, False) == 0.0
    assert onset_evidence(kept, 0.05, 0.2, False) > 6.7
