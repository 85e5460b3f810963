"""The lateness of a channel behind the sensor of its derivative."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.smoothing import smoothed
from rigwatch.physics.transfer import lateness, sensor_phase
from rigwatch.wire.arrays import FloatArray

RATE, SECONDS = 256.0, 24.0
TONES = np.array([0.7, 1.9, 3.1, 4.7, 6.3, 8.9, 12.1])


def motion(late: float, order: int = 0) -> FloatArray:
    """A sum of tones or its derivative, `late` seconds late."""
    omega = 2.0 * np.pi * TONES[:, None]
    phase = omega * (np.arange(0.0, SECONDS, 1.0 / RATE) - late) + np.arange(TONES.size)[:, None]
    grown = 1e-3 * omega**order * np.sin(phase + order * np.pi / 2.0)
    return np.asarray(grown.sum(axis=0))


def noise(size: float, seed: int) -> FloatArray:
    return size * np.random.default_rng(seed).standard_normal(round(SECONDS * RATE))


def high_passed(signal: FloatArray, corner: float) -> FloatArray:
    """Without its slow mean, as a piezo element shows it."""
    mean, out = 0.0, np.empty_like(signal)
    for k, value in enumerate(signal):
        mean += 2.0 * np.pi * corner / RATE * (value - mean)
        out[k] = value - mean
    return out


@pytest.mark.parametrize("late", [-1.2e-3, 0.8e-3, 3e-3])
def test_a_late_position_is_found_behind_an_accelerometer(late: float) -> None:
    acceleration = high_passed(motion(0.0, order=2), 0.4) + noise(0.05, 1)
    quantum = 2e-5
    position = np.round((motion(late) + noise(5e-6, 2)) / quantum) * quantum

    found = lateness([(position, acceleration)], 1.0 / RATE, 2)

    assert found == pytest.approx(late, abs=1.5e-4)


@pytest.mark.parametrize("corner", [0.0, 0.4, 0.9])
def test_the_corner_of_an_accelerometer_shows_in_the_motion_alone(corner: float) -> None:
    acceleration = high_passed(motion(0.0, order=2), corner) + noise(0.05, 1)
    position = motion(0.8e-3) + noise(5e-6, 2)

    found = sensor_phase([(position, acceleration)], 1.0 / RATE, 2)

    assert found is not None
    assert found.is_late_known
    assert found.known_corner == pytest.approx(2.0 * np.pi * corner, abs=0.15)


def test_a_noisy_position_leaves_the_corner_open() -> None:
    acceleration = high_passed(motion(0.0, order=2), 0.4) + noise(0.05, 1)

    found = sensor_phase([(motion(0.0) + noise(1e-3, 2), acceleration)], 1.0 / RATE, 2)

    assert found is None or found.known_corner is None


def test_channels_that_agree_are_left_alone() -> None:
    position, acceleration = motion(0.0) + noise(5e-6, 3), motion(0.0, order=2) + noise(0.05, 4)

    assert abs(lateness([(position, acceleration)], 1.0 / RATE, 2)) < 5e-5


def test_another_quantity_tells_nothing() -> None:
    omega = 2.0 * np.pi * 5.0
    force = motion(0.0, order=2) + omega**2 * motion(0.0) + 40.0 * motion(0.0, order=1)

    assert lateness([(motion(0.0), force)], 1.0 / RATE, 2) == 0.0


def test_a_short_recording_tells_nothing() -> None:
    assert lateness([(motion(0.0)[:200], motion(1e-3, order=2)[:200])], 1.0 / RATE, 2) == 0.0


@pytest.mark.parametrize("order", [0, 1])
def test_a_late_signal_is_smoothed_for_the_instant_of_the_others(order: int) -> None:
    late = 1.1e-3

    found = smoothed(motion(late, 0), 1.0 / RATE, 9, order, late)[20:-20]

    true = motion(0.0, order)[20:-20]
    assert np.abs(found - true).max() < 0.02 * np.abs(true).max()
