"""A servo that is slow between the samples of its command."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.explain.explain import explain
from tests.workbench.machine import Table, studied, tones
from tests.workbench.simulated import knowing

SERVO = """
name = "servo"
summary = "Angle of a servo from its command, which its controller sets a hundred times a second."
hold = "zero"
inputs.command = { unit = "rad" }
states.a = { unit = "rad", derivative = "w", measured = "angle" }
states.w = { unit = "rad/s", derivative = "wn**2*(servo - a) - 2*z*wn*w", rate_of = "angle" }
parameters.wn = { value = 20.0, unit = "1/s", low = 5.0, high = 100.0 }
parameters.z = { value = 0.5, unit = "1", low = 0.05, high = 2.0 }
outputs.angle = { unit = "rad", expression = "a" }
[ports.servo]
kind = "actuator"
signal = "command"
[ports.encoder]
kind = "sensor"
signal = "angle"
"""
SERVO_UNITS = {"command": "rad", "angle": "rad"}
LIMITS = ("rate_limit", "slew_limit", "saturation", "lag", "delay", "valve_hysteresis")
FASTEST = 1.1
"""Rate at which the servo can follow [rad/s]."""


def followed(seed: int, rate: float = 100.0, seconds: float = 30.0, finer: int = 40) -> Table:
    """The angle under a command that is kept for each sample and followed at a limited rate."""
    draw = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / rate)
    command = 0.02 * tones(draw, t, 0.3, 6.0, 10)
    at, a, w, step, angle = command[0], command[0], 0.0, 1 / rate / finer, np.empty(len(t))
    for n, wanted in enumerate(command):
        angle[n] = a
        for _ in range(finer):
            at += np.clip(wanted - at, -FASTEST * step, FASTEST * step)
            w += step * (24.0**2 * (at - a) - 2 * 0.65 * 24.0 * w)
            a += step * w
    return {"command": command, "angle": angle + 5e-5 * draw.normal(size=len(t))}


@pytest.mark.nightly
def test_an_actuator_that_is_slow_is_told_from_a_command_that_changes_slowly(
    tmp_path: Path,
) -> None:
    tables = [followed(seed) for seed in range(3)]
    study = studied(tmp_path, SERVO, tables[:2], tables[2:], SERVO_UNITS)
    found = explain(knowing(study, *LIMITS))
    assert found.verdict == "missing_effect"
    best = found.ranking[0]
    assert (best.effect, best.port) == ("slew_limit", "servo")
    assert best.parameters["rm"].value == pytest.approx(FASTEST, rel=0.03)
    assert best.held_out_error < 1.5 * found.comparison.noise_floor
