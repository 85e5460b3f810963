"""A vehicle that never reverses, where a law by direction is the plain one."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.explain.explain import explain
from tests.workbench.machine import Table, studied, tones
from tests.workbench.simulated import knowing

VEHICLE = """
name = "vehicle"
summary = "Speed of a vehicle from the force of its drive."
inputs.force = { unit = "N" }
states.v = { unit = "m/s", derivative = "(drive - b*v*abs(v) + road)/m", measured = "speed" }
parameters.m = { value = 80.0, unit = "kg", low = 20.0, high = 400.0 }
parameters.b = { value = 0.3, unit = "N s^2/m^2", low = 0.01, high = 10.0 }
outputs.speed = { unit = "m/s", expression = "v" }
[ports.drive]
kind = "actuator"
signal = "force"
[ports.road]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""
DRAG = 4.0
"""Drag that the model lacks [N s/m]."""


def driven(seed: int, finer: int = 20) -> Table:
    """The speed under a force that never turns back."""
    draw = np.random.default_rng(seed)
    t = np.arange(0, 60.0, 0.1)
    force = 60.0 + np.clip(tones(draw, t, 0.02, 0.5, 12) * 20.0, -50.0, 50.0)
    fine = np.interp(np.arange(0, len(t) - 1, 1 / finer), np.arange(len(t)), force)
    speeds, v = [], 6.0
    for n, push in enumerate([*fine, fine[-1]]):
        if n % finer == 0:
            speeds.append(v)
        v += 0.1 / finer * (push - 0.5 * v * abs(v) - DRAG * v) / 90.0
    return {"force": force, "speed": np.array(speeds) + 0.01 * draw.normal(size=len(t))}


def test_of_laws_that_are_the_same_there_the_plain_one_is_named(tmp_path: Path) -> None:
    tables = [driven(seed) for seed in range(3)]
    units = {"force": "N", "speed": "m/s"}
    study = studied(tmp_path, VEHICLE, tables[:2], tables[2:], units, rates=[10.0] * 3)
    found = explain(knowing(study, "viscous", "viscous_by_direction", "gain", "asymmetry"))
    assert found.verdict == "missing_effect"
    best = found.ranking[0]
    assert best.effect == "viscous"
    assert "viscous_by_direction@road" in best.class_
    low, high = best.parameters["d"].interval
    assert low < DRAG < high
