"""Edges of a square wave between samples, from when they are read."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import InputSteps, Moved, SlidingEdges
from monitor.signals import GOOD, NEW_BOOT

WIDTH, N, FINE = 4, 5000, 64
LATER = slice(2500, None)


def square(clock: float, period: float = 32.0, duty: float = 0.5) -> np.ndarray:
    """On a fine grid, shape (N, FINE), of a generator of its own clock."""
    at = (np.arange(N * FINE) + 0.5) / FINE
    return np.where((at * clock + 0.3) % period < duty * period, 1.0, -1.0).reshape(N, FINE)


def codes() -> np.ndarray:
    code = np.full(N, GOOD)
    code[0] = NEW_BOOT
    return code


def followed(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> Moved:
    edges = SlidingEdges(WIDTH)
    parts = [edges.update(signal[a:b], codes()[a:b]) for a, b in pairwise((0, *cuts, N))]
    return Moved(*map(np.concatenate, zip(*parts, strict=True)))


def located(found: Moved, fine: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Samples before the edges that are shown, how early those are, and what was found of it."""
    before = np.flatnonzero(np.diff(fine[: -WIDTH - 2, 0]))
    before = before[found.shows[before + WIDTH]]
    step = fine[before + 1, 0] - fine[before, 0]
    early = (fine.mean(axis=1) - fine[:, 0])[before] / step
    first, second = (found.gained[before + WIDTH + k] / step for k in (0, 1))
    return before, early, np.stack([first, second])


@pytest.mark.parametrize("duty", [0.5, 0.3])
@pytest.mark.parametrize("clock", [0.98, 0.995, 0.9979, 1.0021, 1.005, 1.01, 1.02])
def test_edges_are_found_between_samples(clock, duty) -> None:
    fine = square(clock, duty=duty)
    found = followed(fine[:, 0])

    before, early, gained = located(found, fine)
    late = before > LATER.start
    assert found.shows[LATER].all()
    np.testing.assert_array_equal(found.held[WIDTH:], fine[:-WIDTH, 0])
    assert np.std((gained.sum(axis=0) - early)[late]) < 0.2 * np.std(early[late])


def test_the_two_steps_have_the_centre_of_the_edge() -> None:
    fine = square(1.005)
    _, _, (first, second) = located(followed(fine[:, 0]), fine)

    early = first + second
    np.testing.assert_allclose(0.5 * first + 1.5 * second, early * (1.0 - 0.5 * early), atol=1e-12)


@pytest.mark.parametrize("clock", [0.9995, 0.9979, 1.005, 1.02])
def test_the_error_is_within_what_is_said(clock) -> None:
    fine = square(clock)
    found = followed(fine[:, 0])

    before, early, gained = located(found, fine)
    error = np.abs(gained.sum(axis=0) - early)
    assert error.size
    assert np.mean(error <= found.unsure[before + WIDTH] + 1.0 / FINE) > 0.95


@pytest.mark.parametrize(
    "signal",
    [
        square(1.0)[:, 0],
        square(1.0, duty=0.25)[:, 0],
        np.sin(2.0 * np.pi * np.arange(N) / 32.0),
        np.random.default_rng(4).standard_normal(N),
        np.repeat(np.sign(np.random.default_rng(3).standard_normal(N // 8)), 8),
    ],
    ids=["locked", "duty", "sine", "noise", "random steps"],
)
def test_other_drives_show_no_edges_between_samples(signal) -> None:
    assert not followed(signal).shows.any()


def test_edges_that_are_late_by_chance_lie_on_no_line() -> None:
    late = np.random.default_rng(5).random(N) < 0.5
    read = np.where((np.arange(N) - late) % 32.0 < 16.0, 1.0, -1.0)

    assert not followed(read).shows[LATER].any()


def test_nothing_is_shown_once_the_wave_has_ended() -> None:
    signal = square(1.005)[:, 0].copy()
    signal[3000:] = signal[3000]

    shows = followed(signal).shows
    assert shows[2900]
    assert not shows[3200:].any()


def test_edges_on_a_line_are_surer_than_late_ones() -> None:
    steps = InputSteps(WIDTH).update(square(1.0037)[:, 0], codes())

    assert steps.known[LATER].all()
    assert steps.unsure[LATER].max() < 0.3


def test_results_do_not_depend_on_blocks() -> None:
    signal = square(0.9979)[:, 0]

    for whole, parts in zip(followed(signal), followed(signal, (1, 700, 701)), strict=True):
        np.testing.assert_array_equal(whole, parts)
