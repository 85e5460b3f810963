"""A motor's current, which no channel shows, does not stand in for its friction."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.signals import Data
from tests.workbench.motors import motor_study

EVERY, PARTS = 0.006, 120
"""Time between samples [s], and steps of the simulation in each."""
K, R, L, J = 0.04, 1.4, 0.6e-3, 6e-5
DRY, FAN = 0.006, 2.5e-7


def turned(volts: np.ndarray, seed: int) -> Recording:
    """Speed of a motor with dry friction and a fan: mean torque of each small step, no sticking."""
    step = EVERY / PARTS
    w = i = 0.0
    speeds = np.empty(len(volts))
    for row, volt in enumerate(volts.tolist()):
        speeds[row] = w
        for _ in range(PARTS):
            i = (i + step * (volt - K * w) / L) / (1 + step * R / L)
            w += step * (K * i - FAN * w * abs(w)) / J
            w = float(np.sign(w)) * max(abs(w) - step * DRY / J, 0.0)
    speeds += 0.2 * np.random.default_rng(seed).normal(size=len(volts))
    return Recording(EVERY, volts[:, None], speeds[:, None])


def levels(seed: int, samples: int = 1600) -> np.ndarray:
    """Steps of the voltage, half a second each: within a window it is constant."""
    return np.repeat(np.random.default_rng(seed).uniform(-10, 10, samples // 80), 80)


def bench(horizon: int, seed: int) -> Bench:
    train = joined([turned(levels(seed + each), each) for each in (1, 2)])
    return bench_of(motor_study(R, K), Data(train, turned(levels(seed + 3), 3), None, horizon, ()))


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (10, 30))]
)
def test_a_current_that_every_window_begins_anew_is_no_optimum(seed: int) -> None:
    base = bench(20, seed).base
    found = base.train.values()
    assert base.convergence is not None
    assert base.convergence.converged
    # The inductance hardly shows: its time constant is a tenth of a sample.
    assert 0.98 * J < found["J"] < 1.02 * J
    assert found["L"] < 2 * L
    assert base.held_out_error < 1.5 * base.train_error
