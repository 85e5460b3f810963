"""How broad a motion's spectrum is: tones, noise, rest, any cut of the samples."""

import numpy as np
import pytest

from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.observer.spectral_width import SpectralWidth

RATE, SLOW = 256.0, 0.003


def states(n: int) -> np.ndarray:
    code = np.full(n, WHOLE, np.int64)
    code[0] = FIRST
    return code


def noise(n: int) -> np.ndarray:
    """Speed of equal power at all frequencies from 1.5 to 20 Hz [m/s]."""
    rng = np.random.default_rng(1)
    t = np.arange(n) / RATE
    tones = np.linspace(1.5, 20.0, 60)
    phases = rng.uniform(0.0, 2.0 * np.pi, tones.size)
    return 0.02 * np.sin(2.0 * np.pi * tones * t[:, None] + phases).sum(axis=1)


def settled(speed: np.ndarray) -> np.ndarray:
    return SpectralWidth(SLOW, RATE).update(speed, states(speed.size)).narrow[512:]


@pytest.mark.parametrize("frequency", [4.0, 8.0, 16.0])
def test_a_tone_is_narrow(frequency: float) -> None:
    found = settled(0.2 * np.sin(2.0 * np.pi * frequency * np.arange(2048) / RATE))

    assert found.min() > 0.9
    assert found.max() < 1.15


def test_noise_is_broad() -> None:
    assert np.percentile(settled(noise(4096)), 90) < 0.75


def test_rest_is_not_broad() -> None:
    rng = np.random.default_rng(2)

    assert np.all(settled(0.3 * SLOW * rng.standard_normal(2048)) == 1.0)


@pytest.mark.parametrize("frequency", [4.0, 9.6])
def test_pace_of_a_tone_is_its_frequency(frequency: float) -> None:
    speed = 0.2 * np.sin(2.0 * np.pi * frequency * np.arange(2048) / RATE)
    found = SpectralWidth(SLOW, RATE).update(speed, states(speed.size))

    assert found.pace[512:] == pytest.approx(frequency, rel=0.06)
    assert found.size[1024:] == pytest.approx(0.2 * 2.0 * np.pi * frequency / 2**0.5, rel=0.1)


def test_any_cut_gives_the_same() -> None:
    speed, code = noise(1000), states(1000)
    whole = SpectralWidth(SLOW, RATE).update(speed, code)
    cut = SpectralWidth(SLOW, RATE)

    parts = [cut.update(speed[a:b], code[a:b]) for a, b in ((0, 1), (1, 300), (300, 1000))]

    for name in whole._fields:
        pieces = [getattr(part, name) for part in parts]
        assert np.array_equal(np.concatenate(pieces), getattr(whole, name)), name
