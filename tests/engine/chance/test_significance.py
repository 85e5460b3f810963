"""p-values of the score test: by chance as many as the level says, residuals with memory or not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from rigwatch.physics.engine.score.score_test import Projector, Scores, score
from rigwatch.physics.engine.score.significance import corrected_p_values
from rigwatch.wire.arrays import FloatArray

WINDOWS, SAMPLES, OUTPUTS, CANDIDATES = 5, 256, 2, 20


def remembering(random: np.random.Generator, memory: float, columns: int) -> FloatArray:
    """Series of which each value keeps a share of the one before, shape (windows, k, columns)."""
    new = random.normal(size=(WINDOWS * SAMPLES + 500, OUTPUTS * columns))
    made = np.sqrt(1 - memory**2) * lfilter([1.0], [1.0, -memory], new, axis=0)[500:]
    return np.asarray(made.reshape(WINDOWS, SAMPLES * OUTPUTS, columns))


def scored(random: np.random.Generator, memory: float, size: float = 0.0) -> FloatArray:
    """Corrected p-values of slow candidates beside slow fitted slopes; the first is there."""
    candidates, slopes = remembering(random, 0.9, CANDIDATES), remembering(random, 0.95, 5)
    fitted = Projector(slopes[..., :3], slopes[..., 3:])
    residual = remembering(random, memory, 1) + size * candidates[..., :1]
    left = fitted.clean(residual)[:, 0]
    found: Scores = score(left.reshape(WINDOWS, -1), candidates, fitted, 1.0)
    return corrected_p_values(found, left, OUTPUTS)


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_the_best_of_many_is_significant_as_often_as_the_level_says(memory: float) -> None:
    lowest = [scored(np.random.default_rng(seed), memory).min() for seed in range(100)]
    # 5 %, and a margin for the noise's spectrum, which five windows hardly tell; χ² gave 23 %.
    assert np.sum(np.array(lowest) < 0.05) <= 12


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_what_is_there_is_significant(memory: float) -> None:
    for seed in range(10):
        found = scored(np.random.default_rng(seed), memory, 0.6)
        assert found[0] == found.min() < 1e-3
