"""A push that a mean-free accelerometer hides, of a model fitted to a motion that never rests."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.study import Study
from tests.workbench.machine import Table, recorded, studied

RATE, STEPS, FRICTION, CORNER = 100.0, 50, 0.8, 1.5
UNITS = {"force": "N", "position": "m", "acceleration": "m/s^2"}
SPEED = 2
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


def driven(friction: float, seed: int) -> Table:
    """A mass on a spring behind dry friction that holds it, without any push."""
    random = np.random.default_rng(seed)
    time = np.arange(round(35 * RATE)) / RATE
    phases = random.uniform(0.0, 2 * np.pi, 12)
    force = 1.2 * np.sum(
        [np.sin(2 * np.pi * 0.2 * n * time + p) for n, p in enumerate(phases, 1)], axis=0
    )
    x, v, mean, step, rows = 0.0, 0.0, 0.0, 1.0 / RATE / STEPS, []
    for now in force:
        push = now - 60.0 * x - 1.5 * v
        holds = v == 0.0 and abs(push) <= friction
        a = 0.0 if holds else (push - friction * np.sign(v or push)) / 0.8
        rows.append((x, a - mean))
        for _ in range(STEPS):
            push = now - 60.0 * x - 1.5 * v
            holds = v == 0.0 and abs(push) <= friction
            a = 0.0 if holds else (push - friction * np.sign(v or push)) / 0.8
            after = v + a * step
            v = 0.0 if v * after < 0.0 else after
            x += v * step
            mean += CORNER * (a - mean) * step
    moving = slice(round(5 * RATE), None)
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
    recorded(folder / "healthy.mcap", driven(0.0, 1), UNITS, RATE)
    healthy = '[[healthy]]\nsession = "healthy.mcap"\n'
    tables = [driven(FRICTION, seed) for seed in (2, 3)]
    return studied(folder, MODEL, tables[:1], tables[1:], UNITS, healthy, (RATE, RATE))


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
