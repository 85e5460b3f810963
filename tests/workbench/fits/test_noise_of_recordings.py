"""The noise of a channel over several recordings: where they join, the channel steps."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.workbench.data.noise_floor import quiet_scale

NOISE, RATE = 1e-3, 200.0


def run_at(level: float, samples: int, seed: int) -> Recording:
    time = np.arange(samples) / RATE
    noise = NOISE * np.random.default_rng(seed).normal(size=samples)
    position = level + 0.2 * np.sin(2 * np.pi * 1.5 * time) + noise
    return Recording(1 / RATE, np.zeros((samples, 1)), position[:, None])


def test_it_is_that_of_each_recording() -> None:
    levels = np.linspace(-1.0, 1.0, 12)
    runs = [run_at(level, 1200, seed) for seed, level in enumerate(levels)]
    assert quiet_scale(joined(runs)) == pytest.approx([NOISE], rel=0.15)


def test_a_short_recording_does_not_hide_the_others() -> None:
    runs = [run_at(0.0, 4000, 1), run_at(1.0, 20, 2)]
    assert quiet_scale(joined(runs)) == pytest.approx([NOISE], rel=0.15)
