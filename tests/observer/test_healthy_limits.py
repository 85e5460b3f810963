"""Limits from healthy recordings, and what the same rig shows later."""

import numpy as np
import pytest

from monitor.commissioning.equations.healthy_limits import HealthyPart, healthy_limits
from monitor.model import BANDS
from monitor.observer import Spectrum
from monitor.observer.lagged_motion import WHOLE
from monitor.observer.missing_force import (
    COLUMNS,
    DISAGREE,
    DRY_UNIT,
    MEASURED,
    UNSURE_INPUT,
    VISCOUS_UNIT,
    E,
)

RATE, PERIOD, PERIODS = 256.0, 32, 40
N = PERIOD * PERIODS
SPEED = np.sin(2.0 * np.pi * (np.arange(N) + 0.5) / PERIOD)
MARGIN = 1.6
"""Ratio of the observer's limit of the friction estimate to that of commissioning."""


def recording(seed: int) -> HealthyPart:
    """A steady motion with an error that is the same in each period, as of a locked generator.

    The seed stands for where in the generator's steps the samples fall.
    """
    pattern = np.random.default_rng(seed).standard_normal(PERIOD)
    judged = np.zeros((N, max(len(COLUMNS), UNSURE_INPUT + 1)))
    judged[:, E] = np.tile(pattern / np.sqrt(np.mean(pattern**2)), PERIODS)
    judged[:, DRY_UNIT], judged[:, VISCOUS_UNIT] = -np.sign(SPEED), -SPEED
    judged[:, DISAGREE], judged[:, MEASURED] = 0.1, SPEED
    none = np.zeros(0)
    return HealthyPart(
        judged, SPEED, np.zeros((N, 1)), np.ones(N), np.full(N, WHOLE), Spectrum(*[none] * 5),
        none, np.zeros((0, BANDS)),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(0, 40, 2))
def test_an_error_that_falls_otherwise_between_the_samples_is_no_friction(seed: int) -> None:
    commissioned, later = (
        healthy_limits([recording(k)], 1e-3, PERIOD, RATE) for k in (seed, seed + 1)
    )

    assert later.friction < MARGIN * commissioned.friction
