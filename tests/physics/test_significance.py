"""The best of all candidates is significant by chance as often as its p-value says."""

import numpy as np
from scipy.signal import lfilter

from rigwatch.physics.engine.score.score_test import Projector, Scores, score
from rigwatch.physics.engine.score.significance import corrected_p_values
from rigwatch.wire.arrays import FloatArray

WINDOWS, LENGTH, CANDIDATES = 10, 60, 40
SAMPLES = WINDOWS * LENGTH
TIME = np.arange(SAMPLES).reshape(WINDOWS, LENGTH)


def fitted() -> Projector:
    """Two parameters, and two initial states a window that show in both outputs."""
    since = TIME[0] / LENGTH
    start = np.stack([1 - since, since], axis=-1)
    starts = np.broadcast_to(np.repeat(start, 2, axis=0), (WINDOWS, 2 * LENGTH, 2))
    parameters = np.stack([np.sin(TIME / 9), np.cos(TIME / 14)], axis=-1)
    return Projector(np.repeat(parameters, 2, axis=1), starts)


def directions() -> FloatArray:
    """Motions with several frequencies, each in one output, (windows, 2·samples, candidates)."""
    found, random = np.zeros((WINDOWS, LENGTH, 2, CANDIDATES)), np.random.default_rng(0)
    for index in range(CANDIDATES):
        periods, phases = np.exp(random.uniform(np.log(12), np.log(240), 6)), range(6)
        waves = [np.sin(2 * np.pi * TIME / p + k) for p, k in zip(periods, phases, strict=True)]
        found[:, :, index % 2, index] = np.sum(waves, axis=0)
    return found.reshape(WINDOWS, -1, CANDIDATES)


FITTED, DIRECTIONS = fitted(), directions()


def noise(seed: int) -> FloatArray:
    """The first output's is remembered for 20 samples, the second's is white."""
    white = np.random.default_rng(seed).standard_normal((SAMPLES + 200, 2))
    slow = np.sqrt(1 - 0.9**2) * lfilter([1.0], [1.0, -0.9], white[:, 0])
    both = np.stack([slow, white[:, 1]], axis=-1)[200:]
    return both.reshape(WINDOWS, -1)


def ranked(error: FloatArray) -> tuple[Scores, FloatArray]:
    """Scores and p-values of the candidates for what the fit leaves of an error."""
    left = FITTED.clean(error[..., None]).reshape(WINDOWS, LENGTH, 2)
    scores = score(error, DIRECTIONS, FITTED, 1.0)
    return scores, corrected_p_values(scores, left)


def test_coloured_noise_in_short_windows_is_seldom_taken_for_an_effect() -> None:
    best = np.array([ranked(noise(seed))[1].min() for seed in range(30)])
    assert np.sum(best < 0.05) <= 4
    assert np.sum(best < 0.01) <= 1


def test_an_effect_far_above_the_noise_does_not_count_as_noise_itself() -> None:
    scores, p_values = ranked(noise(1) + DIRECTIONS[..., 21])
    assert np.argmax(scores.explained) == 21
    assert p_values[21] < 1e-6
