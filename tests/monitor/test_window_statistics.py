"""Friction from the last samples: in newtons although contacts deform before they slide."""

import numpy as np
import pytest

from monitor.observer import window_statistics
from monitor.observer.decision_state import AT, DRY, ERROR, HISTORY, SPEED, WET, new_state
from tests.compiled import from_python

dry_force = from_python(window_statistics.dry_force)
friction = from_python(window_statistics.friction)

FORCE, LENGTH = 0.6, 64


@pytest.mark.parametrize("late", [-1, 0, 1, 2])
def test_force_does_not_fall_with_samples_in_which_friction_turns(late: int) -> None:
    at = np.arange(HISTORY)
    speed = np.sin(2.0 * np.pi * (at + 0.3) / 32.0)
    kept = new_state(1)
    kept.rows[:, SPEED], kept.rows[:, WET] = speed, -speed
    kept.rows[:, DRY] = -np.sign(speed)
    kept.rows[:, ERROR] = FORCE * np.roll(kept.rows[:, DRY], late)
    kept.counts[AT.filled] = HISTORY

    force, viscous, _, share, _ = friction(kept, LENGTH, 1e-3)

    assert force == pytest.approx(FORCE, rel=1e-6)
    assert dry_force(kept, LENGTH, LENGTH)[0] == pytest.approx(FORCE, rel=1e-6)
    assert viscous == pytest.approx(0.0, abs=1e-6)
    assert share == pytest.approx(1.0, abs=1e-3)


def test_a_motion_that_turns_at_every_sample_shows_no_friction() -> None:
    kept = new_state(1)
    kept.rows[::2, SPEED], kept.rows[1::2, SPEED] = 1.0, -1.0
    kept.rows[:, DRY], kept.rows[:, ERROR] = 1.0, 1.0
    kept.counts[AT.filled] = HISTORY

    assert friction(kept, LENGTH, 1e-3) == (0.0, 0.0, 0.0, 0.0, 0.0)
