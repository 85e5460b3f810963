"""The equations' residual as a polynomial: what it may depend on."""

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.signal import lfilter

from monitor.observer import RemainderTerms, fit_remainder, high_pass, information_matrix, layout_of
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.missing_force import terms
from monitor.observer.remainder_terms import SIZE, counting_terms
from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

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


def test_what_a_motion_does_not_tell_apart_is_not_known() -> None:
    known = signals(0.0, 20.0)
    judged = lfilter(*FILTERS, residual(known, 1))

    found = fit_remainder([(known, judged)], FILTERS, 256, (DRIFTS,))

    covariance = np.linalg.inv(information_matrix(found, (DRIFTS,)))
    # Of sin, cos, sin², sin·cos and cos² at one frequency, the squares are not told apart.
    sum_of_squares = np.array([0.0, 0.0, 1.0, 0.0, 1.0]) / np.sqrt(2.0)
    difference = np.array([0.0, 0.0, 1.0, 0.0, -1.0]) / np.sqrt(2.0)
    unsure, surer = (float(each @ covariance @ each) for each in (sum_of_squares, difference))
    raw = terms(known, np.array(found.centre), np.array(found.scale))
    left = (judged - lfilter(*FILTERS, raw @ np.array(found.weights)))[256:]
    share = np.mean(judged[256:] ** 2) / np.mean(left**2)
    assert unsure == pytest.approx(SIZE**2 * share, rel=0.01)
    assert surer < 0.5 * unsure


def test_terms_that_count_are_high_passed_sample_by_sample() -> None:
    z = signals(0.0, 4.0)
    section = fit_remainder([(z, residual(z, 1))], FILTERS, 256, (DRIFTS,))
    state = np.full(len(z), WHOLE)
    state[0] = FIRST
    whole = RemainderTerms(section, (DRIFTS,), 2.0, RATE)
    parts = RemainderTerms(section, (DRIFTS,), 2.0, RATE)

    found = whole.update(z, state)

    raw = terms(z, np.array(section.centre), np.array(section.scale))
    raw = raw[:, counting_terms(z.shape[1], (DRIFTS,))]
    assert found == pytest.approx(lfilter(*FILTERS, raw - raw[0], axis=0), abs=1e-9)
    pieces = np.split(np.arange(len(z)), [1, 7, 300])
    assert np.array_equal(np.vstack([parts.update(z[at], state[at]) for at in pieces]), found)


def test_a_model_with_a_wrong_number_of_informations_is_refused() -> None:
    section = fit_remainder([(signals(0.0, 20.0), np.ones(5120))], FILTERS, 256, (DRIFTS,))
    short = replace(section, information=section.information[1:])

    with pytest.raises(ModelError, match=r"remainder.information: found 14 values, expected 15"):
        information_matrix(short, (DRIFTS,))
