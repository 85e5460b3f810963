"""An input whose steps jitter at the instants of sampling: what acts, from its samples."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import InputSteps, Jittered, JitteredSteps
from monitor.signals import GOOD, NEW_BOOT

WIDTH, N = 4, 3000
AT = np.arange(N)
SETTLED = slice(200, None)


def sine(n: np.ndarray) -> np.ndarray:
    """8 Hz at 256 samples a second."""
    return 1.4 * np.sin(2.0 * np.pi * n / 32.0)


def triangle(n: np.ndarray) -> np.ndarray:
    """5 Hz at 256 samples a second."""
    return np.arcsin(np.sin(2.0 * np.pi * n / 51.2))


def several(n: np.ndarray) -> np.ndarray:
    """Tones up to 11 Hz at 256 samples a second."""
    return np.sum([np.sin(2.0 * np.pi * hz * n / 256.0 + hz**2) for hz in (1, 3, 4, 7, 11)], axis=0)


def read(shape, late: float, noise: float = 0.0) -> np.ndarray:
    """Samples of which the share `late` is read before the update."""
    rng = np.random.default_rng(6)
    return shape(AT - (rng.random(N) < late)) + noise * rng.standard_normal(N)


def codes() -> np.ndarray:
    code = np.full(N, GOOD)
    code[0] = NEW_BOOT
    return code


def followed(signal: np.ndarray, cuts: tuple[int, ...] = ()) -> Jittered:
    steps = JitteredSteps(WIDTH)
    parts = [steps.update(signal[a:b], codes()[a:b]) for a, b in pairwise((0, *cuts, N))]
    return Jittered(*map(np.concatenate, zip(*parts, strict=True)))


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("late", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("shape", [sine, triangle, several])
def test_the_voltage_in_force_is_found(shape, late, noise) -> None:
    signal = read(shape, late, noise)
    found = followed(signal)

    assert found.jitters[SETTLED].all()
    true = shape(AT)[:-WIDTH]
    before = np.std((signal[:-WIDTH] - true)[SETTLED])
    assert np.std((found.value[WIDTH:] - true)[SETTLED]) < 0.5 * before


@pytest.mark.parametrize(
    "signal",
    [
        sine(AT),
        sine(AT) + 0.02 * np.random.default_rng(2).standard_normal(N),
        triangle(1.0037 * AT),
        several(AT),
        np.sign(sine(AT + 0.5)),
        np.random.default_rng(3).standard_normal(N),
        np.zeros(N),
        sine(np.floor(AT * 1.0045 + 0.3)),
    ],
    ids=["sine", "noisy", "triangle", "several", "square", "noise", "rest", "sliding"],
)
def test_other_drives_do_not_jitter(signal) -> None:
    assert not followed(signal).jitters.any()


def test_results_do_not_depend_on_blocks() -> None:
    signal = read(sine, 0.5)
    whole, parts = followed(signal), followed(signal, (1, 7, 8, 400, 401))

    np.testing.assert_array_equal(whole.value, parts.value)
    np.testing.assert_array_equal(whole.jitters, parts.jitters)


@pytest.mark.parametrize("half_width", [2, 3, 9])
def test_any_lag_has_the_sample_that_it_means(half_width) -> None:
    found = JitteredSteps(half_width).update(sine(AT), codes())

    np.testing.assert_array_equal(found.value[2 * half_width :], sine(AT)[half_width:-half_width])


@pytest.mark.parametrize(("late", "unsure"), [(0.0, 0.0), (0.5, 0.1)])
def test_what_is_not_known_of_the_steps_is_said(late, unsure) -> None:
    found = InputSteps(WIDTH).update(read(sine, late), codes())

    assert found.known[SETTLED].all()
    np.testing.assert_array_equal(found.unsure[SETTLED], unsure)
