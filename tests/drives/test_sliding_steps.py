"""An input held on a clock of its own: its mean between samples, from its samples alone."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import Sliding, SlidingSteps
from monitor.signals import GOOD, NEW_BOOT

WIDTH, N, FINE = 4, 5000, 16
RNG = np.random.default_rng(4)


def sine(t: np.ndarray) -> np.ndarray:
    """8 Hz at 256 samples a second."""
    return 1.4 * np.sin(2.0 * np.pi * t / 32.0)


def triangle(t: np.ndarray) -> np.ndarray:
    """5 Hz at 256 samples a second."""
    return np.arcsin(np.sin(2.0 * np.pi * t / 51.2))


def staircase(shape, clock: float, begins: float = 0.3) -> np.ndarray:
    """The voltage on a fine grid, shape (N, FINE), held by a generator of its own clock."""
    at = np.arange(N * FINE) / FINE
    return shape(np.floor(at * clock + begins)).reshape(N, FINE)


def followed(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> Sliding:
    code = np.full(signal.size, GOOD)
    code[0] = NEW_BOOT
    steps = SlidingSteps(WIDTH)
    ends = pairwise((0, *cuts, signal.size))
    parts = [steps.update(signal[a:b], code[a:b]) for a, b in ends]
    return Sliding(*map(np.concatenate, zip(*parts, strict=True)))


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("shape", [sine, triangle])
@pytest.mark.parametrize("clock", [0.9935, 0.9978, 1.0045, 1.016])
def test_mean_between_samples_is_found_once_the_clock_is_known(shape, clock, noise) -> None:
    fine = staircase(shape, clock)
    found = followed(fine[:, 0] + noise * RNG.standard_normal(N))

    mean, held = fine.mean(axis=1)[:-WIDTH], fine[:-WIDTH, 0]
    late = slice(-N // 4, None)
    assert not found.known.all()
    assert found.known[late].all()
    left = np.std((found.mean[WIDTH:] - mean)[late])
    assert left < 0.25 * np.std((held - mean)[late])


def test_skips_that_a_corner_hides_do_not_double_the_interval() -> None:
    # A skip every 454.5 samples, of which the triangle's corners hide every second one at first.
    fine = staircase(lambda t: np.arcsin(np.sin(2.0 * np.pi * t / 32.0)), 1.0022)
    found = followed(fine[:, 0])

    late = slice(-N // 4, None)
    mean, held = fine.mean(axis=1)[:-WIDTH][late], fine[:-WIDTH, 0][late]
    assert np.std(found.mean[WIDTH:][late] - mean) < 0.25 * np.std(held - mean)


@pytest.mark.parametrize(
    "signal",
    [
        sine(np.arange(N)),
        sine(np.arange(N)) + 0.02 * RNG.standard_normal(N),
        triangle(1.0037 * np.arange(N)),
        np.where(np.arange(N) % 32 < 16, 1.0, -1.0),
        np.sin(2.0 * np.pi * (0.004 + 0.5 * 0.074 * np.arange(N) / N) * np.arange(N)),
        RNG.standard_normal(N),
        np.zeros(N),
    ],
    ids=["locked", "noisy", "free", "square", "chirp", "noise", "rest"],
)
def test_other_inputs_stay_as_they_are(signal) -> None:
    found = followed(signal)

    assert found.known.all()
    assert np.array_equal(found.mean[2 * WIDTH :], signal[WIDTH:-WIDTH])


def test_a_jump_of_phase_is_no_clock() -> None:
    at = np.arange(N) + np.where(np.arange(N) > 900, 1.0, 0.0)

    found = followed(sine(at))

    assert not found.known[910]
    assert found.known[-1]
    assert np.array_equal(found.mean[2 * WIDTH :], sine(at)[WIDTH:-WIDTH])


def test_a_clock_that_skips_less_often_than_a_jump_is_waited_for_is_followed() -> None:
    # 0.08 % off: a skip every 1250 samples, three in these 5000.
    found = followed(staircase(sine, 1.0008)[:, 0])

    assert found.followed[-N // 8 :].all()


def test_block_sizes_change_no_bit() -> None:
    signal = staircase(sine, 1.0045)[:, 0]

    whole, parts = followed(signal), followed(signal, (1, 3, 8, 200, 777, 1500))

    assert np.array_equal(whole.mean, parts.mean)
    assert np.array_equal(whole.known, parts.known)
