"""A rig that sticks: its speed is exactly zero there, and the instants of stopping do not count.

A push that an accelerometer without mean hides does not come in where the rig rests.
"""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.study import Study
from tests.workbench.machine import Table, recorded, studied
from tests.workbench.simulated import HORIZON, study

RATE, STEPS, NOISE = 128.0, 32, 2e-6
SPEED = 2

SAMPLED, FINE, FRICTION, CORNER = 100.0, 50, 0.8, 1.5
UNITS = {"force": "N", "position": "m", "acceleration": "m/s^2"}
MODEL = f"""
name = "tilted"
summary = "A mass on a spring. A push that its accelerometer does not show is six newtons off."
hold = "zero"
[inputs.force]
unit = "N"
[quantities]
acceleration = {{ expression = "(drive - k*x - c*v + push + load)/m", unit = "m/s^2" }}
[states.x]
unit = "m"
derivative = "v"
measured = "position"
[states.v]
unit = "m/s"
derivative = "acceleration"
rate_of = "position"
[states.mean]
unit = "m/s^2"
derivative = "wa*(acceleration - mean)"
[parameters]
m = {{ value = 0.8, unit = "kg", low = 0.01, high = 100.0, fixed = true }}
k = {{ value = 50.0, unit = "N/m", low = 1.0, high = 1e4 }}
c = {{ value = 1.0, unit = "N s/m", low = 0.0, high = 100.0 }}
push = {{ value = 6.0, unit = "N", fixed = true }}
wa = {{ value = {CORNER}, unit = "1/s", low = 0.01, high = 30.0, fixed = true }}
[outputs.position]
unit = "m"
expression = "x"
[outputs.acceleration]
unit = "m/s^2"
expression = "acceleration - mean"
[ports.drive]
kind = "actuator"
signal = "force"
[ports.load]
kind = "force"
unit = "N"
variables.x = {{ expression = "x", unit = "m" }}
variables.v = {{ expression = "v", unit = "m/s" }}
"""


def acceleration(force: float, x: float, v: float, friction: float) -> float:
    """That of a mass on a spring, at rest while its dry friction holds it."""
    push = force - 60.0 * x - 1.5 * v
    holds = v == 0.0 and abs(push) <= friction
    return 0.0 if holds else float(push - friction * np.sign(v or push)) / 0.8


def speed_after(v: float, a: float, step: float) -> float:
    """The speed a step later: friction stops what would turn around."""
    after = v + a * step
    return 0.0 if v * after < 0.0 else after


def moved(friction: float, seed: int) -> tuple[Recording, np.ndarray]:
    """A mass on a spring behind friction that holds it, and whether it sticks at each sample."""
    time = np.arange(24 * round(RATE)) / RATE
    drive = 6.0 * np.sin(2 * np.pi * 0.8 * time) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.1 * time))
    x, v, step, rows, stuck = 0.0, 0.0, 1.0 / RATE / STEPS, [], []
    for force in drive:
        a = 0.0
        for _ in range(STEPS):
            a = acceleration(force, x, v, friction)
            v = speed_after(v, a, step)
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


def driven(friction: float, seed: int) -> Table:
    """A mass on a spring behind dry friction that holds it, without any push."""
    random = np.random.default_rng(seed)
    time = np.arange(round(35 * SAMPLED)) / SAMPLED
    phases = random.uniform(0.0, 2 * np.pi, 12)
    force = 1.2 * np.sum(
        [np.sin(2 * np.pi * 0.2 * n * time + p) for n, p in enumerate(phases, 1)], axis=0
    )
    x, v, mean, step, rows = 0.0, 0.0, 0.0, 1.0 / SAMPLED / FINE, []
    for now in force:
        rows.append((x, acceleration(now, x, v, friction) - mean))
        for _ in range(FINE):
            a = acceleration(now, x, v, friction)
            v = speed_after(v, a, step)
            x += v * step
            mean += CORNER * (a - mean) * step
    moving = slice(round(5 * SAMPLED), None)
    table = np.array(rows)[moving]
    return {
        "force": force[moving],
        "position": table[:, 0] + 2e-6 * random.standard_normal(len(table)),
        "acceleration": table[:, 1] + 0.01 * random.standard_normal(len(table)),
    }


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """The study of a rig that rests now and then, with a healthy recording that never does."""
    folder = Path(tmp_path_factory.mktemp("tilted"))
    recorded(folder / "healthy.mcap", driven(0.0, 1), UNITS, SAMPLED)
    healthy = '[[healthy]]\nsession = "healthy.mcap"\n'
    tables = [driven(FRICTION, seed) for seed in (2, 3)]
    return studied(folder, MODEL, tables[:1], tables[1:], UNITS, healthy, (SAMPLED, SAMPLED))


@pytest.mark.nightly
def test_dry_friction_is_named_whatever_push_the_sensor_hides(rubbing: Study) -> None:
    bench = open_bench(rubbing)
    assert bench.data.healthy is not None
    assert (bench.data.train.inputs[:, SPEED] == 0.0).any()
    assert not (bench.data.healthy.inputs[:, SPEED] == 0.0).any()

    found = explain(rubbing)

    top = found.ranking[0]
    assert found.verdict == "missing_effect"
    assert (top.effect, top.port) == ("coulomb", "load")
    low, high = top.parameters["Fc"].interval or (0.0, 0.0)
    assert low < FRICTION < high
    assert high - low < 0.2 * FRICTION
