"""The equations' residual as a polynomial: what it may depend on."""

import numpy as np
import pytest
from scipy.signal import lfilter

from monitor.observer import fit_remainder, high_pass, layout_of
from monitor.observer.missing_force import terms
from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.arrays import FloatArray

RATE = 256.0
FILTERS = high_pass(2.0, RATE)
DRIFTS = 2


def signals(begin: float, seconds: float) -> FloatArray:
    """Two signals of a steady motion at 8 Hz, and the mean of a sensor that drifts."""
    t = begin + np.arange(round(seconds * RATE)) / RATE
    phase = 2.0 * np.pi * 8.0 * t
    return np.column_stack([np.sin(phase), np.cos(phase), 5.0 - 5.0 * np.exp(-t / 100.0)])


def residual(z: FloatArray, seed: int) -> FloatArray:
    """What equations leave: a force that grows with the square of the motion, and noise."""
    noise = np.random.default_rng(seed).standard_normal(len(z))
    return 0.4 * z[:, 0] ** 2 + 0.1 * z[:, 0] * z[:, 1] + 0.05 * noise


@pytest.mark.parametrize("begin", [20.0, 300.0], ids=["next", "minutes later"])
def test_a_sensors_mean_that_drifts_leaves_the_remainder_as_it_is(begin: float) -> None:
    known, later = signals(0.0, 20.0), signals(begin, 20.0)
    judged = lfilter(*FILTERS, residual(known, 1))
    found = fit_remainder([(known, judged)], FILTERS, 256, (DRIFTS,))
    moved = later.copy()
    moved[:, DRIFTS] = known[: len(later), DRIFTS]

    centre, scale, weights = map(np.array, (found.centre, found.scale, found.weights))
    described = terms(later, centre, scale) @ weights
    assert np.array_equal(described, terms(moved, centre, scale) @ weights)
    expected = residual(later, 2)
    left = (expected - described)[512:]
    assert np.std(left) == pytest.approx(0.05, rel=0.1)


def test_the_remainder_depends_on_motion_and_forces_but_not_on_the_accelerometer() -> None:
    layout = layout_of(shipped_models()["servo-pneumatic"], "load")

    assert layout.signals == ("voltage", "x", "v")
    # x, v, then the pressures, the valve's two states, and the accelerometer's mean.
    assert layout.sensed == (6,)
