"""The frequency response from voltage to position has the published shape."""

import numpy as np
import pytest

from .rig_runs import gain, settled

AMPLITUDES = 0.7, 1.6


@pytest.fixture(scope="module")
def response() -> dict[tuple[float, float], float]:
    """|x / V| by amplitude and frequency [m/V]; 8 s hold whole cycles of all of them."""
    frequencies = [0.5, 1, 2, 3, 4, 5, 6, 7, 7.5, 7.75, 8, 8.25, 8.5, 8.75, 9, 12, 18]
    return {
        (amplitude, f): abs(gain(settled(amplitude, f, seconds=8.0), f))
        for amplitude in AMPLITUDES
        for f in frequencies
        if (amplitude, f) != (1.6, 0.5)
    }


def slope(response: dict[tuple[float, float], float], low: float, high: float) -> float:
    """Order of the roll-off between two frequencies."""
    ratio = response[0.7, low] / response[0.7, high]
    return float(np.log(ratio) / np.log(high / low))


def test_one_integrator_at_low_frequency(response):
    assert slope(response, 0.5, 1) == pytest.approx(1.0, abs=0.05)
    assert slope(response, 1, 2) == pytest.approx(1.0, abs=0.06)


def test_resonance_lies_between_8_and_9_hertz(response):
    def peak(order: int) -> float:
        near = [f for amplitude, f in response if amplitude == 0.7 and 6 <= f <= 12]
        return max(near, key=lambda f: response[0.7, f] * f**order)

    assert 7.75 <= peak(0) <= 9
    assert 8 <= peak(1) <= 9
    assert 8 <= peak(2) <= 9
    assert response[0.7, 8] > 1.2 * response[0.7, 6]


def test_about_four_orders_of_roll_off_above_it(response):
    assert 3.5 < slope(response, 12, 18) < 5.0


def test_amplitude_matters_near_the_resonance_only(response):
    change = {f: response[1.6, f] / response[0.7, f] for f in (1, 2, 3, 8.25, 8.5, 8.75)}
    assert all(abs(change[f] - 1) < 0.025 for f in (1, 2, 3))
    assert all(change[f] - change[2] > 0.04 for f in (8.25, 8.5, 8.75))


def test_little_motion_above_ten_hertz(response):
    assert response[0.7, 18] < 0.01 * response[0.7, 1]
