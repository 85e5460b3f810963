"""A coil around solid iron, whose current rises at once as if its voltage had come earlier."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.explain.explain import explain
from tests.workbench.machine import Table, studied
from tests.workbench.simulated import knowing

COIL = """
name = "coil"
summary = "Current of a coil from its voltage, which an amplifier holds from sample to sample."
hold = "zero"
inputs.voltage = { unit = "V" }
states.psi = { unit = "Wb", derivative = "amplifier - R*psi/L + winding" }
parameters.L = { value = 0.1, unit = "H", low = 0.01, high = 1.0 }
parameters.R = { value = 1.0, unit = "ohm", low = 0.1, high = 10.0 }
outputs.current = { unit = "A", expression = "psi/L" }
[ports.winding]
kind = "force"
unit = "V"
passive = true
variables.i = { expression = "psi/L", unit = "A" }
variables.ic = { expression = "psi/L", unit = "A" }
[ports.amplifier]
kind = "actuator"
signal = "voltage"
"""
UNITS = {"voltage": "V", "current": "A"}
RATE = 500.0  # [1/s]
INDUCTANCE, RESISTANCE = 0.08, 2.0  # [H], [ohm]
IRON, CORNER = 2.5, 80.0
"""Resistance of the currents in the iron [ohm], and the frequency above which they flow [1/s]."""


def current(voltage: FloatArray, draw: np.random.Generator) -> Table:
    """Under a voltage that is held: from one sample to the next by the matrix exponential."""
    coupling = np.array([[-RESISTANCE - IRON, IRON], [CORNER, -CORNER]])
    coupling[:, 0] /= INDUCTANCE  # states: flux linkage [Wb] and current in the iron [A]
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[0, 2] = coupling, 1.0
    step, state, psi = expm(whole / RATE), np.zeros(3), np.empty(len(voltage))
    for n, volts in enumerate(voltage):
        psi[n], state[2] = state[0], volts
        state = step @ state
    return {"voltage": voltage, "current": psi / INDUCTANCE + 0.02 * draw.normal(size=len(psi))}


def test_currents_in_the_iron_are_no_voltage_recorded_late(tmp_path: Path) -> None:
    draw = np.random.default_rng(3)
    t = np.arange(0, 6.0, 1 / RATE)
    steps = np.repeat(draw.uniform(-20, 20, 30), len(t) // 30)
    pulses = np.repeat(draw.choice([-20.0, 0.0, 20.0], 60), len(t) // 60)
    slow = 17 * np.sin(2 * np.pi * 1.3 * t)
    train = [current(steps, draw), current(pulses, draw)]
    study = studied(tmp_path, COIL, train, [current(slow, draw)], UNITS, rates=[RATE] * 3)
    found = explain(knowing(study, "eddy_currents", "viscous", "gain", "lag", "dead_band"))
    assert found.verdict == "missing_effect"
    best = found.ranking[0]
    assert best.effect == "eddy_currents"
    assert best.parameters["R"].value == pytest.approx(IRON, rel=0.1)
    assert best.parameters["w"].value == pytest.approx(CORNER, rel=0.1)
