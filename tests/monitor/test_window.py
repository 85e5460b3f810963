"""Windowed least squares: exact after many updates, spikes, and any window."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.estimation import window as windows
from monitor.estimation.energies import SIGNALS, add, energy, new_energies, recent_energy
from monitor.estimation.window import new_window, push, sums, windowed_least_squares
from tests.compiled import from_python

solve_two = from_python(windows.solve_two)


def fresh(g: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(g, y, rcond=None)[0]


@pytest.mark.parametrize("spike", [0.0, 1e6, 1e12])
def test_exact_after_a_spike(spike: float) -> None:
    random = np.random.default_rng(0)
    n, window = 20_000, 300
    v = np.sin(0.19 * np.arange(n)) + 0.1 * random.standard_normal(n)
    g = np.column_stack([np.sign(v), v])
    y = g @ np.array([1.0, 0.2]) + 0.01 * random.standard_normal(n)
    y[n - 3 * window] += spike
    theta = np.empty((n, 2))
    g1, g2 = g[:, 0].copy(), g[:, 1].copy()
    windowed_least_squares(new_window(window), g1, g2, y, theta)
    for end in (n - 1, n - 150, n - window, 5000):
        part = slice(end + 1 - window, end + 1)
        assert np.max(np.abs(theta[end] - fresh(g[part], y[part]))) < 1e-9


@given(length=st.integers(1, 20), count=st.integers(1, 90), seed=st.integers(0, 99))
@settings(max_examples=60, deadline=None)
def test_sums_are_those_of_the_last_samples(length: int, count: int, seed: int) -> None:
    rows = np.random.default_rng(seed).standard_normal((count, 3))
    window, found = new_window(length), np.empty(6)
    for row in rows:
        push(window, row)
    sums(window, found)
    last = rows[-length:]
    assert np.allclose(found, (last.T @ last)[np.triu_indices(3)], rtol=1e-12, atol=1e-12)


@given(length=st.integers(1, 20), count=st.integers(1, 90), recent=st.integers(1, 20))
@settings(max_examples=60, deadline=None)
def test_energies_are_those_of_the_last_samples(length: int, count: int, recent: int) -> None:
    rows = np.random.default_rng(count).standard_normal((count, SIGNALS))
    kept = new_energies(length)
    for row in rows:
        add(kept, row)
    squares = rows[-length:] ** 2
    assert energy(kept, 1) == pytest.approx(squares[:, 1].sum())
    assert recent_energy(kept, 0, recent) == pytest.approx(squares[-recent:, 0].sum())


def test_a_singular_window_is_reported_and_gives_no_number() -> None:
    theta1, theta2, condition = solve_two(np.array([1.0, 2.0, 3.0, 4.0, 6.0, 9.0]))
    assert (theta1, theta2) == (0.0, 0.0)
    assert condition == np.inf
