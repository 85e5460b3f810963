"""What a drive does to a voltage that only the model's equations compute is found there."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.explain import explain
from tests.workbench.machine import studied

SERVO = """
name = "servo"
summary = "A motor that turns an arm to a goal; its controller is in the equations."
hold = "zero"
inputs.goal = { unit = "rad" }
quantities.wanted = { expression = "kp*(goal - x)", unit = "V" }
quantities.push = { expression = "K*drive", unit = "N m" }
states.x = { unit = "rad", derivative = "v", measured = "angle" }
states.v = { unit = "rad/s", derivative = "(push - b*v + gear)/J", rate_of = "angle" }
parameters.kp = { value = 6.0, unit = "V/rad", fixed = true }
parameters.K = { value = 0.4, unit = "N m/V", low = 0.01 }
parameters.b = { value = 0.2, unit = "N m s/rad", low = 0.0 }
parameters.J = { value = 0.05, unit = "kg m^2", fixed = true }
outputs.angle = { unit = "rad", expression = "x" }

[ports.drive]
kind = "actuator"
signal = "wanted"

[ports.gear]
kind = "force"
unit = "N m"
variables.x = { expression = "x", unit = "rad" }
variables.v = { expression = "v", unit = "rad/s" }

[ports.encoder]
kind = "sensor"
signal = "angle"
"""
STEP = 1e-3


def _run(seed: int) -> dict[str, np.ndarray]:
    """Six seconds of a servo whose driver's duty is limited; current builds up in its winding."""
    generator = np.random.default_rng(seed)
    goal = np.repeat(generator.uniform(-1.2, 1.2, 12), 50)
    x = v = current = 0.0
    angle = np.empty(len(goal))
    for k in range(len(goal) * 10):
        if k % 10 == 0:
            angle[k // 10] = x
        # The controller runs at 1 kHz and asks for a share of 12 V, at most 22 % of them.
        volts = 12.0 * float(np.clip(6.0 * (goal[k // 10] - x) / 12.0, -0.22, 0.22))
        current += STEP * (volts - 1.0 * current - 0.1 * v) / 0.003
        v += STEP * (0.5 * current - 0.1 * v) / 0.05
        x += STEP * v
    return {"goal": goal, "angle": angle + 2e-3 * generator.normal(size=len(goal))}


def test_a_limited_driver_within_the_loop_is_named(tmp_path: Path) -> None:
    study = studied(tmp_path, SERVO, [_run(1)], [_run(2)], {"goal": "rad", "angle": "rad"})
    found = explain(study)
    assert found.verdict == "missing_effect"
    first = found.ranking[0]
    assert (first.effect, first.port) == ("saturation", "drive")
    assert abs(first.parameters["us"].value - 0.22 * 12.0) < 0.1
