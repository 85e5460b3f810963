"""What is slow in a drive begins each log with a value of its own, fitted with the first window."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Placement, compose
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.fit import Recording, fit, joined, windows

ROTOR = """
name = "rotor"
summary = "Speed of a rotor from the torque at its shaft."
hold = "zero"
inputs.torque = { unit = "N m" }
states.w = { unit = "rad/s", derivative = "(drive - b*w)/J", measured = "speed" }
parameters.J = { value = 0.03, unit = "kg m^2", low = 1e-6 }
parameters.b = { value = 0.02, unit = "N m s/rad", low = 0.0 }
outputs.speed = { unit = "rad/s", expression = "w" }
ports.drive = { kind = "actuator", signal = "torque" }
"""
J, B, TAU, DT, NOISE = 0.03, 0.02, 0.2, 0.01, 0.01
HORIZON = 50


def log(seed: int) -> Recording:
    """A log that begins while the rotor turns; the torque arrives late by a first-order lag.

    The closed form of both between samples, from the eigenvalues of their equations.
    """
    draw = np.random.default_rng(seed)
    torque = np.repeat(draw.uniform(-0.4, 0.4, 90), 10)
    lag, own = np.exp(-DT / TAU), np.exp(-DT * B / J)
    passed = (lag - own) / (1 - J / (B * TAU)) / B
    arriving, speed, found = 0.0, 0.0, np.empty(len(torque))
    for k, held in enumerate(torque):
        found[k] = speed
        resting = held / B
        speed = resting + (speed - resting) * own + (arriving - held) * passed
        arriving = held + (arriving - held) * lag
    begun = 300
    noisy = found + NOISE * draw.standard_normal(len(found))
    return Recording(DT, torque[begun:, None], noisy[begun:, None])


def test_a_lag_of_the_drive_is_found_and_leaves_noise_where_each_log_begins() -> None:
    model = parse_model(ROTOR, Path("rotor.toml"))
    placement = Placement("lag", library()["lag"], "drive")
    compiled = compile_system(compose(model, [placement]))
    logs = [log(seed) for seed in range(4)]
    made = joined(logs)
    start = compiled.vector({placement.prefix + "tau": 0.1})
    found = fit(compiled, made, HORIZON, start=start)
    assert found.values()[placement.prefix + "tau"] == pytest.approx(TAU, rel=0.05)
    begun = windows(compiled.system, len(made), HORIZON).starts % len(logs[0]) == 0
    assert found.residuals[begun].std(axis=1).max() < 1.5 * NOISE
