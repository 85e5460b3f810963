"""Whether a generator holds each voltage for several samples, from its samples."""

from itertools import pairwise

import numpy as np
import pytest

from monitor.drives import HeldReadings, InputSteps
from monitor.signals import GOOD, NEW_BOOT

N, RATE = 3000, 256.0
AT = np.arange(N)
SETTLED = slice(300, None)


def sine(n: np.ndarray, hz: float = 8.0) -> np.ndarray:
    return 1.4 * np.sin(2.0 * np.pi * hz * n / RATE)


def updated(hz: float) -> np.ndarray:
    """A sine that is updated at this rate, read with noise."""
    held = sine(np.floor(AT * hz / RATE + 1e-9) * RATE / hz)
    return held + 5e-4 * np.random.default_rng(1).standard_normal(N)


def codes() -> np.ndarray:
    code = np.full(N, GOOD)
    code[0] = NEW_BOOT
    return code


@pytest.mark.parametrize("updates_hz", [140.0, 128.0, 97.3, 64.0, 45.0])
def test_held_readings_are_found_and_leave_instants_unsure(updates_hz: float) -> None:
    signal = updated(updates_hz)

    assert HeldReadings().update(signal, codes())[SETTLED].all()
    np.testing.assert_array_equal(InputSteps(4).update(signal, codes()).unsure[SETTLED], 0.5)


@pytest.mark.parametrize(
    "signal",
    [
        sine(AT),
        sine(AT, 20.0),
        sine(AT, 1.0),
        sine(AT) + 0.02 * np.random.default_rng(2).standard_normal(N),
        np.round(sine(AT) / 0.02) * 0.02,
        np.arcsin(np.sin(2.0 * np.pi * AT / 51.0)),
        np.sign(sine(AT + 0.5)),
        np.sign(sine(AT + 0.5, 20.0)),
        np.random.default_rng(3).standard_normal(N),
        np.zeros(N),
        sine(AT - (np.random.default_rng(6).random(N) < 0.5)),
    ],
    ids=["sine", "fast", "slow", "noisy", "quantised", "triangle", "square", "fast square", "noise",
         "rest", "jitter"],
)  # fmt: skip
def test_other_drives_are_not_held(signal: np.ndarray) -> None:
    assert not HeldReadings().update(signal, codes()).any()


def test_results_do_not_depend_on_blocks() -> None:
    signal, held = updated(97.3), HeldReadings()
    cuts = (0, 1, 7, 8, 400, 401, N)
    parts = [held.update(signal[a:b], codes()[a:b]) for a, b in pairwise(cuts)]

    np.testing.assert_array_equal(np.concatenate(parts), HeldReadings().update(signal, codes()))
