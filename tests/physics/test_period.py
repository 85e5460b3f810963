"""After how many samples an excitation repeats, by trying lags and by its autocorrelation."""

import numpy as np
import pytest

from rigwatch.physics.transfer.period import period_by_correlation, shortest_period
from rigwatch.wire.arrays import FloatArray


def noise_of(samples: int, seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(samples)


def repeated(period: int, times: float) -> FloatArray:
    base = noise_of(period)
    return np.tile(base - base.mean(), int(np.ceil(times)))[: round(period * times)]


def within(share: float):
    return lambda part: share * float(np.mean(part**2))


@pytest.mark.parametrize("period", [5, 64, 187])
def test_both_searches_find_the_period_and_not_a_multiple(period: int) -> None:
    signal = repeated(period, 8.4)
    assert period_by_correlation(signal, within(1e-6)) == period
    assert shortest_period(signal, range(4, len(signal) // 2), within(1e-6)) == period


def test_the_allowed_difference_decides() -> None:
    signal = repeated(64, 8.0)
    signal += 0.05 * signal.std() * noise_of(len(signal), seed=2)
    assert period_by_correlation(signal, within(2e-4)) == 0
    assert period_by_correlation(signal, within(1e-2)) == 64
    assert shortest_period(signal, range(4, 200), lambda _: 1e-4) == 0
    assert shortest_period(signal, range(4, 200), lambda _: 1e-2) == 64


def test_the_lags_that_are_given_are_tried_in_order() -> None:
    signal = repeated(32, 8.0)
    assert shortest_period(signal, [31, 64, 32], within(1e-6)) == 64
    assert shortest_period(signal, [], within(1e-6)) == 0


@pytest.mark.parametrize(
    "signal",
    [
        pytest.param(noise_of(500), id="noise"),
        pytest.param(np.zeros(500), id="nothing"),
        pytest.param(repeated(4, 3.0), id="too short"),
        pytest.param(repeated(300, 1.4), id="less than two periods"),
        pytest.param(np.linspace(-1, 1, 500), id="a ramp"),
    ],
)
def test_what_does_not_repeat_has_no_period(signal: FloatArray) -> None:
    assert period_by_correlation(signal, within(2e-4)) == 0
