"""A recording that hits an end stop is named with the travel reached; free motion is not."""

import numpy as np
import pytest

from monitor.commissioning.end_stop import hit_stops
from monitor.observer import base_model
from monitor.signals import Recording
from monitor.signals.recordings import recording_of

RATE, SECONDS, STEPS = 256.0, 8.0, 40
MODEL = base_model("servo-pneumatic")


def recorded(drive: np.ndarray, middle: float, stop: float) -> Recording:
    """A mass on a soft spring about `middle` [m], with a hard stop at `stop` [m]."""
    rows, x, v, step = [], middle, 0.0, 1.0 / RATE / STEPS
    for u in drive:
        for _ in range(STEPS):
            hit = max(x - stop, 0.0)
            a = 20.0 * u - 400.0 * (x - middle) - 4.0 * v - (4e4 * hit + 40.0 * v * (hit > 0.0))
            v += a * step
            x += v * step
        rows.append((u, x, a))
    voltage, position, acceleration = np.array(rows).T
    channels = {"voltage": voltage, "position": position, "acceleration": acceleration}
    return recording_of("healthy", "run", RATE, channels)


def tone() -> np.ndarray:
    return np.asarray(np.sin(2.0 * np.pi * 4.0 * np.arange(round(SECONDS * RATE)) / RATE))


def noise() -> np.ndarray:
    white = np.random.default_rng(5).standard_normal(round(SECONDS * RATE))
    return np.convolve(white, np.ones(8) / 3.0, "same")


@pytest.mark.parametrize("drive", [tone(), noise()], ids=["tone", "noise"])
def test_only_a_motion_that_is_thrown_back_is_said_to_hit_a_stop(drive: np.ndarray) -> None:
    free = recorded(drive, 0.0, 1.0)
    reached = float(free.channel("position").max())

    assert not hit_stops([free], MODEL)
    said = hit_stops([free, recorded(drive, 0.0, 0.3 * reached)], MODEL)
    assert f"run is thrown back at {0.3 * reached:.1g}"[:-1] in said
    assert "record again" in said
