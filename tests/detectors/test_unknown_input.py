"""Nowakowski et al.: the bias of a position sensor on a cart, detected, then estimated."""

import numpy as np
import pytest
from scipy.special import chdtrc
from scipy.stats import binom

from monitor.detectors.innovation_test import new_nis_window, nis_limit, push_nis
from monitor.detectors.kalman import augmented_matrices, generalised_update, kalman_update
from monitor.detectors.small_matrices import inverse
from monitor.detectors.state_space import state_space
from rigwatch.physics.transfer.transfer_function import TransferFunction
from rigwatch.wire.errors import ModelError
from tests.detectors import pendulum

LENGTH, MEASURED = 20, 3
BIAS, AT = 0.05, 10.0


@pytest.fixture(scope="module")
def healthy():
    return [pendulum.run(40.0, seed=seed) for seed in range(10)]


@pytest.mark.nightly
def test_the_plain_filters_innovations_are_of_the_expected_size(healthy):
    """Mean of 40 000 chi-square values of three degrees of freedom, within four standard errors."""
    nis = np.concatenate([one[0][200:] for one in healthy])
    assert nis.mean() == pytest.approx(MEASURED, abs=4 * np.sqrt(2 * MEASURED / nis.size))


@pytest.mark.parametrize("false_alarm", [0.05, 0.01])
def test_the_rate_of_false_alarms_is_the_chosen_one(healthy, false_alarm):
    """Windows that do not overlap, against a binomial count."""
    limit = nis_limit(LENGTH, MEASURED, false_alarm)
    sums = np.concatenate([one[1][200 + LENGTH :: LENGTH] for one in healthy])
    count = int(np.sum(sums > limit))
    low, high = binom.ppf([1e-4, 1 - 1e-4], sums.size, false_alarm)
    assert low <= count <= high


def whiteness(innovations, lags):
    """p-value of n·Σ ρ(l)² over lags 1 … `lags` under whiteness; ρ(l): autocorrelation."""
    centred = innovations - innovations.mean()
    power = float(centred @ centred)
    correlations = np.array([centred[lag:] @ centred[:-lag] for lag in range(1, lags + 1)]) / power
    return float(chdtrc(lags, innovations.size * np.sum(correlations**2)))


def test_the_innovations_are_white(healthy):
    p_values = [whiteness(one[2][200:], lags=20) for one in healthy]
    assert min(p_values) > 1e-4
    assert np.mean(np.array(p_values) < 0.05) <= 0.4


def test_a_filter_that_ignores_the_dynamics_fails_the_whiteness_test():
    rng = np.random.default_rng(5)
    coloured = np.convolve(rng.standard_normal(4000), [1.0, 0.5], mode="valid")
    assert whiteness(coloured, lags=20) < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_the_bias_is_detected_at_once_and_then_estimated(seed):
    _, total, _, bias, general, states = pendulum.run(20.0, BIAS, AT, seed)
    at = round(AT / pendulum.STEP)
    found = np.flatnonzero(total > nis_limit(LENGTH, MEASURED, 1e-9))
    assert found.size
    assert 0 <= found[0] - at <= 2
    after = bias[at : at + 500]
    assert after.mean() == pytest.approx(BIAS, rel=0.1)
    assert np.abs(bias[200:at]).mean() < 0.1 * BIAS
    error = general[at:, 0] - states[at:, 0]
    assert np.abs(error).max() < 0.3 * BIAS


def test_the_bias_as_estimated_corrects_the_reading():
    """The paper's claim: take the bias off the faulty reading and the fault is gone."""
    _, total, _, bias, _, _ = pendulum.run(20.0, BIAS, AT, 1)
    at = round(AT / pendulum.STEP)
    force, y, _ = pendulum.simulated(20.0, BIAS, AT, 1)
    y[at:, 0] -= bias[at : at + 200].mean()
    corrected = pendulum.filtered(force, y, LENGTH)[1]
    assert np.nanmax(corrected[at : at + 50]) < 0.1 * np.nanmax(total[at : at + 50])


def test_a_bias_on_everything_cannot_be_told():
    with pytest.raises(ModelError, match="does not show"):
        augmented_matrices(np.eye(2), np.zeros((2, 0)), np.zeros((2, 1)))


def test_with_no_unknown_input_it_is_the_kalman_filter():
    """(2.60)-(2.61) are the information form of the same step."""
    rng = np.random.default_rng(2)
    root = rng.standard_normal((3, 3))
    h, v = rng.standard_normal((2, 3)), np.diag([0.3, 0.7])
    x, p, y = rng.standard_normal(3), root @ root.T + np.eye(3), rng.standard_normal(2)
    plain, plain_p, general, general_p = x.copy(), p.copy(), x.copy(), p.copy()
    kalman_update(plain, plain_p, h, v, y)
    e, c = augmented_matrices(h, np.zeros((3, 0)), np.zeros((2, 0)))
    assert generalised_update(general, general_p, e, c, np.linalg.inv(v), y, np.zeros(3))
    np.testing.assert_allclose(general, plain, rtol=1e-10)
    np.testing.assert_allclose(general_p, plain_p, rtol=1e-9)


def test_an_unknown_state_input_is_found_from_two_measurements():
    """ξ of the step before, exactly, where there is no noise to speak of."""
    a, f = np.array([[1.0, 0.1], [0.0, 0.9]]), np.array([[0.0], [1.0]])
    e, c = augmented_matrices(np.eye(2), f, np.zeros((2, 0)))
    x = np.zeros(2)
    z, p, augmented = np.zeros(2), 1e-6 * np.eye(2), np.zeros(3)
    for k in range(40):
        force = np.sin(0.3 * k)
        x = a @ x + f[:, 0] * force
        z, p = a @ z, a @ p @ a.T + 1e-6 * np.eye(2)
        assert generalised_update(z, p, e, c, 1e10 * np.eye(2), x, augmented)
        assert augmented[2] == pytest.approx(force, abs=1e-3)


def test_a_singular_covariance_is_reported_not_raised():
    x, p = np.zeros(2), np.zeros((2, 2))
    assert np.isnan(kalman_update(x, p, np.eye(2), np.zeros((2, 2)), np.ones(2)))
    assert not generalised_update(x, p, np.eye(2), np.eye(2), np.eye(2), np.ones(2), np.zeros(2))
    assert not x.any()


def test_the_inverse_does_not_mind_units():
    rng = np.random.default_rng(7)
    root = rng.standard_normal((5, 5)) * np.array([1e-6, 1.0, 1e4, 1e-3, 1e2])[:, None]
    matrix = root @ root.T
    out = np.empty_like(matrix)
    assert inverse(matrix, out)
    scale = np.sqrt(np.diag(matrix))
    np.testing.assert_allclose(
        (out * scale[:, None] * scale) @ (matrix / scale[:, None] / scale), np.eye(5), atol=1e-9
    )


def test_the_windows_sum_does_not_keep_a_spike():
    window = new_nis_window(16)
    for value in [1.0] * 20 + [1e17] + [1.0] * 40:
        total = push_nis(window, value)
    assert total == 16.0


@pytest.mark.parametrize("b", [[0.0, 0.3], [0.0, 0.3, -0.2, 0.1], [0.0, 0.0, 0.5]])
def test_the_state_space_model_is_the_transfer_function(b):
    function = TransferFunction.of(b, [1.0, -1.2, 0.5, -0.1])
    model = state_space(function)
    u = np.random.default_rng(3).standard_normal(100)
    x, y = np.zeros(model.b.size), np.empty(100)
    for k in range(100):
        y[k] = model.position_row() @ x
        x = model.a @ x + model.b * u[k]
    np.testing.assert_allclose(y, function.simulate(u), atol=1e-12)


def test_a_model_without_delay_has_no_prediction():
    with pytest.raises(ModelError, match="without delay"):
        state_space(TransferFunction.of([1.0, 0.5], [1.0, -0.5]))
