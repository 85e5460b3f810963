"""Initial states as directions: the least squares of every window, and what they cannot make."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.initial_state_projection import Tangent

RNG = np.random.default_rng(8)
WINDOWS, SAMPLES, STATES = 5, 40, 3
SLOPES = RNG.normal(size=(WINDOWS, SAMPLES, STATES))
VALUES = RNG.normal(size=(WINDOWS, SAMPLES, 2))
ALL, KNOWN_LAST = np.arange(STATES), np.array([0, 1])


@pytest.mark.parametrize("known", [False, True])
def test_each_window_is_solved_as_least_squares_would(known):
    first, rest = np.array([0]), np.arange(1, WINDOWS)
    groups = [(first, ALL), (rest, KNOWN_LAST)] if known else [(np.arange(WINDOWS), ALL)]
    tangent = Tangent(SLOPES, groups)
    found, left = tangent.solve(VALUES), tangent.without(VALUES)
    for w in range(WINDOWS):
        columns = KNOWN_LAST if known and w else ALL
        wanted = np.linalg.lstsq(SLOPES[w][:, columns], VALUES[w], rcond=None)[0]
        np.testing.assert_allclose(found[w, columns], wanted, atol=1e-12)
        np.testing.assert_allclose(left[w], VALUES[w] - SLOPES[w][:, columns] @ wanted, atol=1e-12)
    assert not known or not found[1:, 2].any()


def test_a_state_that_shows_nowhere_is_left_alone():
    blind = SLOPES.copy()
    blind[..., 1] = 0.0
    found = Tangent(blind, [(np.arange(WINDOWS), ALL)]).solve(VALUES)
    assert np.abs(found[:, 1]).max() < 1e-9
    assert np.isfinite(found).all()


def test_states_that_show_alike_are_told_apart_as_far_as_the_samples_allow():
    alike = SLOPES.copy()
    alike[..., 2] = alike[..., 1] + 1e-12 * SLOPES[..., 2]
    found = Tangent(alike, [(np.arange(WINDOWS), ALL)]).solve(VALUES)
    for w in range(WINDOWS):
        wanted = np.linalg.lstsq(alike[w], VALUES[w], rcond=1e-10)[0]
        np.testing.assert_allclose(found[w], wanted, atol=1e-6)
