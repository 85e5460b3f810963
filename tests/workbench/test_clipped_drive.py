"""A drive that clips is told from a sensor that does, though friction hides the noise of both."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking import rank
from tests.workbench.motors import motor_study
from tests.workbench.simulated import COMMON, knowing

STEP, EVERY, CLIPPED = 5e-5, 80, 7.0
K, R, L, J, B, PUSHED, PULLED = 0.045, 1.2, 0.9e-3, 5.5e-5, 1.5e-5, 0.009, 0.006


def driven(volts: np.ndarray, seed: int) -> Recording:
    """A motor whose dry friction differs by direction, with true sticking, stepped by hand."""
    w = i = 0.0
    speeds = np.empty(len(volts))
    for row, volt in enumerate(volts.tolist()):
        speeds[row] = w
        for _ in range(EVERY):
            i += STEP * (min(max(volt, -CLIPPED), CLIPPED) - R * i - K * w) / L
            torque = K * i - B * w
            limit = PUSHED if (w or torque) > 0 else PULLED
            if w == 0.0:
                w = STEP * max(abs(torque) - limit, 0.0) * (1 if torque > 0 else -1) / J
                continue
            after = w + STEP * (torque - (limit if w > 0 else -limit)) / J
            w = 0.0 if after * w < 0 else after
    speeds += 0.3 * np.random.default_rng(seed).normal(size=len(volts))
    return Recording(STEP * EVERY, volts[:, None], speeds[:, None])


def stepped(samples: int, seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return np.repeat(generator.uniform(-9, 9, samples // 100), 100)


def swinging(samples: int, lines: tuple[float, ...], seed: int) -> np.ndarray:
    t, phases = STEP * EVERY * np.arange(samples), np.random.default_rng(seed).uniform(0, 6, 3)
    sines = [np.sin(2 * np.pi * f * t + p) for f, p in zip(lines, phases, strict=True)]
    return np.asarray(9 * sum(sines) / np.abs(sum(sines)).max())


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [5, 6])
def test_a_sensor_that_clips_does_not_stand_in_for_a_drive_that_does(seed: int) -> None:
    study = knowing(motor_study(R, K), *COMMON)
    train = [stepped(2400, seed), swinging(2400, (0.23, 0.7, 1.7), seed)]
    held_out = swinging(2400, (0.4, 1.1, 2.1), seed + 10)
    made = joined([driven(volts, index) for index, volts in enumerate(train)])
    data = Data(made, driven(held_out, 3), None, 24, ())
    bench = bench_of(study, data)
    rows = rank(bench.study, data, bench.base, bench.floor)
    assert rows[0].label == "saturation@drive"
