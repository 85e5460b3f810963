"""Commissioning takes a variant of the equations if the healthy recordings ask for it.

A mass is pushed by the piston of an actuator whose pressure follows a voltage. On one machine the
motion does not change the pressure; on the other it does, and a controller drives it back. How fast
the pressure follows is known: else a stiffer spring would describe the healthy motion as well.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete

from monitor.commissioning.equations.fitted_equations import fitted_equations
from monitor.model import EquationsPlant
from monitor.observer import equations_of
from monitor.signals.recordings import Recording, recording_of
from rigwatch.wire.arrays import FloatArray

RATE, MASS, AREA, SPRING, DAMPER = 256.0, 0.5, 1e-3, 300.0, 4.0
SLOW, GAIN, STIFF = 25.0, 2e4, 2e5
MODEL = """
name = "pushed"
summary = "A mass and a piston."
hold = "zero"

[inputs.voltage]
unit = "V"

[quantities]
acceleration = { expression = "(A*p - c*v - k*x + load)/m", unit = "m/s^2" }

[states.x]
unit = "m"
derivative = "v"
measured = "position"

[states.v]
unit = "m/s"
derivative = "acceleration"
rate_of = "position"

[states.p]
unit = "Pa"
derivative = "w*(G*drive - p)"

[parameters]
m = { value = 0.5, unit = "kg", low = 0.01, fixed = true }
A = { value = 1e-3, unit = "m^2", low = 1e-5, fixed = true }
k = { value = 200.0, unit = "N/m", low = 0.0, high = 2000.0 }
c = { value = 2.0, unit = "N s/m", low = 0.0, high = 50.0 }
w = { value = 25.0, unit = "1/s", low = 1.0, high = 1000.0, fixed = true }
G = { value = 1.5e4, unit = "Pa/V", low = 1e2, high = 1e6 }

[outputs.position]
unit = "m"
expression = "x"

[outputs.acceleration]
unit = "m/s^2"
expression = "acceleration"

[ports.drive]
kind = "actuator"
signal = "voltage"

[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }

[variants.compressed]
physics = "The motion changes the pressure, which a controller drives back."
parameters.B = { value = 1e4, unit = "Pa/m", low = 0.0, high = 1e7 }
states.p = { unit = "Pa", derivative = "w*(G*drive - p) - B*v" }

[variants.prompt]
physics = "The pressure is the voltage's at once."
without = ["w"]
states.p = { unit = "Pa", derivative = "1000[1/s]*(G*drive - p)" }
"""


def pushed(volts: FloatArray, compressed: float, name: str, seed: int) -> Recording:
    """The machine under a held voltage, by its exact response, with noisy sensors."""
    a = np.array(
        [
            [0.0, 1.0, 0.0],
            [-SPRING / MASS, -DAMPER / MASS, AREA / MASS],
            [0.0, -compressed, -SLOW],
        ]
    )
    b = np.array([[0.0], [0.0], [SLOW * GAIN]])
    step = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), 1.0 / RATE, "zoh")
    state, found = np.zeros(3), np.zeros((volts.size, 3))
    for row, value in enumerate(volts):
        found[row] = state
        state = step[0] @ state + step[1][:, 0] * value
    random = np.random.default_rng(seed)
    channels = {
        "voltage": volts,
        "position": found[:, 0] + 2e-6 * random.standard_normal(volts.size),
        "acceleration": found @ a[1] + 0.02 * random.standard_normal(volts.size),
    }
    return recording_of("healthy", name, RATE, channels)


def commissioned(compressed: float, folder: Path) -> EquationsPlant:
    model = folder / "pushed.toml"
    model.write_text(MODEL)
    turns = 2.0 * np.pi * np.arange(round(14.0 * RATE)) / RATE
    tones = {"slow": 2.0 * turns, "middle": 4.7 * turns, "fast": 9.0 * turns}
    recordings = [
        pushed(np.sin(phase), compressed, name, seed)
        for seed, (name, phase) in enumerate(tones.items())
    ]
    return fitted_equations(recordings, str(model), 1.0, RATE, [False] * 3, {})


def test_the_variant_whose_law_the_machine_has_is_taken(tmp_path: Path) -> None:
    plant = commissioned(STIFF, tmp_path)

    assert plant.variants == ("compressed",)
    assert plant.names == tuple(equations_of(plant).parameters)
    assert dict(zip(plant.names, plant.values, strict=True))["B"] == pytest.approx(STIFF, rel=0.05)


def test_equations_that_leave_only_noise_are_taken_as_they_are(tmp_path: Path) -> None:
    plant = commissioned(0.0, tmp_path)

    assert plant.variants == ()
    assert dict(zip(plant.names, plant.values, strict=True))["c"] == pytest.approx(DAMPER, rel=0.05)
