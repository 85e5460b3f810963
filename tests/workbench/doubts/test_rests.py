"""A rig that sticks: its speed is exactly zero there, and the instants of stopping do not count."""

import numpy as np

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import Data
from tests.workbench.simulated import HORIZON, study

RATE, STEPS, NOISE = 128.0, 32, 2e-6
SPEED = 2


def moved(friction: float, seed: int) -> tuple[Recording, np.ndarray]:
    """A mass on a spring behind friction that holds it, and whether it sticks at each sample."""
    time = np.arange(24 * round(RATE)) / RATE
    drive = 6.0 * np.sin(2 * np.pi * 0.8 * time) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.1 * time))
    x, v, step, rows, stuck = 0.0, 0.0, 1.0 / RATE / STEPS, [], []
    for force in drive:
        a = 0.0
        for _ in range(STEPS):
            push = force - 60.0 * x - 1.5 * v
            holds = v == 0.0 and abs(push) <= friction
            a = 0.0 if holds else (push - friction * np.sign(v or push)) / 0.8
            after = v + a * step
            v = 0.0 if v * after < 0.0 else after
            x += v * step
        rows.append((force, x, a))
        stuck.append(v == 0.0)
    table = np.array(rows)
    table[:, 1] += NOISE * np.random.default_rng(seed).standard_normal(time.size)
    return Recording(1 / RATE, table[:, :1], table[:, 1:]), np.array(stuck)


def test_a_rig_that_sticks_has_no_speed_and_one_that_slides_has() -> None:
    (healthy, _), (rubs, stuck) = moved(0.0, 1), moved(4.0, 2)
    assert 0.2 < stuck.mean() < 0.8

    _, along = along_motion(study(), Data(rubs, rubs, healthy, HORIZON, ()))

    assert along.healthy is not None
    still = along.train.inputs[:, SPEED] == 0.0
    assert not (along.healthy.inputs[round(RATE) :, SPEED] == 0.0).any()
    assert still[stuck].mean() > 0.8
    assert still[~stuck].mean() < 0.1
    beside = still | np.roll(still, 4) | np.roll(still, -4)
    assert np.isnan(along.train.outputs[beside]).all()
    assert np.isfinite(along.train.outputs[~stuck]).mean() > 0.5
