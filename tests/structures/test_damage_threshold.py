import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.structures.damage.threshold import (
    FORGETTING,
    CumulativeSum,
    false_alarm,
    threshold_for,
)

SIGNALS, SAMPLES = 4, 300


def share_of_alarms(threshold: float, records: int, calibration: int) -> float:
    random = np.random.default_rng(7)
    total, alarmed = np.zeros(records), np.zeros(records, bool)
    sigma = np.ones((records, SIGNALS))
    if calibration:
        trial = random.standard_normal((records, calibration, SIGNALS))
        sigma = np.sqrt(np.mean(trial**2, axis=1))
    for _ in range(SAMPLES):
        energy = np.sum((random.standard_normal((records, SIGNALS)) / sigma) ** 2, axis=1)
        total = np.maximum(0.0, total + energy - FORGETTING * SIGNALS)
        alarmed |= total > threshold
    return float(alarmed.mean())


@pytest.mark.parametrize("calibration", [0, 150])
def test_noise_alone_alarms_as_often_as_calculated(calibration: int) -> None:
    threshold = threshold_for(0.1, SIGNALS, SAMPLES, calibration)
    # 4000 records: one standard deviation is 0.5 %.
    assert share_of_alarms(threshold, 4000, calibration) == pytest.approx(0.1, abs=0.025)


@settings(max_examples=15, deadline=None)
@given(rate=st.floats(1e-4, 0.5), signals=st.integers(1, 12), samples=st.integers(10, 2000))
def test_the_threshold_has_the_rate_that_was_asked_for(
    rate: float, signals: int, samples: int
) -> None:
    threshold = threshold_for(rate, signals, samples)
    assert false_alarm(threshold, signals, samples) == pytest.approx(rate, rel=0.02)


def test_an_uncertain_noise_asks_for_a_higher_threshold() -> None:
    assert threshold_for(0.01, 8, 1000, 50) > threshold_for(0.01, 8, 1000, 500)
    assert threshold_for(0.01, 8, 1000, 500) > threshold_for(0.01, 8, 1000)


def test_a_missing_sample_moves_nothing_up() -> None:
    adding = CumulativeSum(SIGNALS, 10.0)
    adding.value = 5.0
    assert not adding.update(np.full(SIGNALS, np.nan))
    assert adding.value == pytest.approx(5.0 - (FORGETTING - 1.0) * SIGNALS)


def test_the_onset_is_where_the_sum_left_zero() -> None:
    adding = CumulativeSum(1, 20.0)
    steps = [0.1, 0.1, 3.0, 3.0, 3.0]
    alarms = [adding.update(np.array([step])) for step in steps]
    assert alarms == [False, False, False, False, True]
    assert adding.zero == 3
