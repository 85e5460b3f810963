"""Two sensors of one motion deny a gain of either that their proportion does not show."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.fit import Recording
from rigwatch.workbench.ranking import denies_gain

RATE, RATE_COLUMN = 256.0, 2


def read(gain: float, seed: int, hidden: bool = True) -> Recording:
    """A motion of three tones, its position read with a gain, its acceleration with noise."""
    t = np.arange(4096) / RATE
    random = np.random.default_rng(seed)
    tones = [
        (size, 2.0 * np.pi * hz, random.uniform(0, 6)) for size, hz in ((4, 1.5), (2, 4), (1, 7))
    ]
    x = sum(size * 1e-3 * np.sin(w * t + phase) for size, w, phase in tones)
    v = sum(size * 1e-3 * w * np.cos(w * t + phase) for size, w, phase in tones)
    a = -sum(size * 1e-3 * w**2 * np.sin(w * t + phase) for size, w, phase in tones)
    a = a + 0.02 * np.std(a) * random.standard_normal(t.size)
    a[np.abs(v) < 0.05 * np.std(v)] = np.nan
    shown = a if hidden else random.standard_normal(t.size)
    return Recording(
        1 / RATE, np.column_stack([np.zeros(t.size), gain * x, gain * v]), shown[:, None]
    )


@pytest.mark.parametrize("gain", [1.06, 0.94])
def test_a_gain_that_the_other_sensor_does_not_see_is_denied(gain: float) -> None:
    assert "which a gain of" in denies_gain(read(1.0, 1), read(1.0, 2), RATE_COLUMN, gain)
    assert denies_gain(read(1.0, 1), read(gain, 2), RATE_COLUMN, 1 / gain)


@pytest.mark.parametrize("gain", [1.06, 0.94, 1.008])
def test_a_gain_that_is_there_or_too_small_to_be_seen_is_not(gain: float) -> None:
    assert not denies_gain(read(1.0, 1), read(gain, 2), RATE_COLUMN, gain)
    assert not denies_gain(read(1.0, 1), read(1.0, 2), RATE_COLUMN, 1.008)


def test_an_output_that_does_not_show_the_motion_denies_nothing() -> None:
    assert not denies_gain(read(1.0, 1, hidden=False), read(1.0, 2), RATE_COLUMN, 1.06)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_whether_it_is_denied_does_not_depend_on_the_units_of_the_other_sensor(
    scale: float,
) -> None:
    def rough(gain: float, seed: int) -> Recording:
        """Its acceleration read as a force, with a proportion that changes by 3 % in between."""
        found = read(gain, seed)
        drifting = 1 + 0.03 * np.sin(2 * np.pi * np.arange(len(found)) / 900)
        return replace(found, outputs=scale * drifting[:, None] * found.outputs)

    assert denies_gain(rough(1.0, 1), rough(1.0, 2), RATE_COLUMN, 1.2)
    assert not denies_gain(rough(1.0, 1), rough(1.0, 2), RATE_COLUMN, 1.02)
