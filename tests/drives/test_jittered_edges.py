"""Edges of a square wave that are read a sample late by chance."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import InputSteps, JitteredEdges
from monitor.signals import GOOD, NEW_BOOT

N = 6000
AT = np.arange(N)
SHOWN = slice(3000, None)


def square(n: np.ndarray, period: float, duty: float = 0.5) -> np.ndarray:
    """Of a period in samples."""
    return np.where((n / period + 1e-9) % 1.0 < duty, 1.0, -1.0)


def codes() -> np.ndarray:
    code = np.full(N, GOOD)
    code[0] = NEW_BOOT
    return code


def instants(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> list[np.ndarray]:
    edges = JitteredEdges()
    parts = [edges.update(signal[a:b], codes()[a:b]) for a, b in pairwise((0, *cuts, N))]
    return [np.concatenate(each) for each in zip(*parts, strict=True)]


def found(signal: np.ndarray) -> np.ndarray:
    return instants(signal)[0]


def jittered(period: float, late: float = 0.5) -> np.ndarray:
    return square(AT - (np.random.default_rng(5).random(N) < late), period)


@pytest.mark.parametrize("late", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("period", [32.0, 36.57, 64.0])
def test_late_edges_are_noticed(period, late) -> None:
    assert found(jittered(period, late))[SHOWN].mean() > 0.8


def test_an_edge_that_is_late_for_the_first_time_is_noticed_at_once() -> None:
    late = 1920
    signal = square(AT, 32.0)
    signal[late] = -1.0

    assert np.flatnonzero(found(signal))[0] == late + 1


def test_edges_that_slide_over_the_samples_are_noticed() -> None:
    assert found(square(1.0037 * AT, 32.0))[SHOWN].all()


@pytest.mark.parametrize(
    "signal",
    [
        square(AT, 32.0),
        square(AT, 36.57),
        square(AT, 51.2, 0.3),
        square(AT, 32.0) + 0.02 * np.random.default_rng(2).standard_normal(N),
        np.sin(2.0 * np.pi * AT / 32.0),
        np.repeat(np.sign(np.random.default_rng(3).standard_normal(N // 8)), 8),
        np.random.default_rng(4).standard_normal(N),
    ],
    ids=["8 Hz", "7 Hz", "duty", "noisy", "sine", "random steps", "noise"],
)
def test_other_drives_have_no_late_edges(signal) -> None:
    assert not found(signal).any()


def test_results_do_not_depend_on_blocks() -> None:
    signal = jittered(32.0)

    for whole, cut in zip(instants(signal), instants(signal, (1, 500, 501)), strict=True):
        np.testing.assert_array_equal(whole, cut)


def test_the_instants_of_late_edges_are_unsure() -> None:
    steps = InputSteps(4).update(jittered(32.0), codes())

    np.testing.assert_array_equal(steps.unsure[SHOWN], 0.5)


def test_the_motion_shows_the_instants_of_edges_that_jitter() -> None:
    assert InputSteps(4).update(jittered(32.0), codes()).jitters[SHOWN].mean() > 0.7


@pytest.mark.parametrize(
    "signal",
    [
        square(1.0037 * AT, 32.0),
        np.where(AT < 3000, square(AT, 32.0), square(AT - 1, 32.0)),
        np.where(AT < 2900, jittered(32.0), 1.0),
    ],
    ids=["they slide", "one was late", "the wave has ended"],
)
def test_the_motion_shows_no_instants_of_other_edges(signal) -> None:
    assert not InputSteps(4).update(signal, codes()).jitters[SHOWN].any()
