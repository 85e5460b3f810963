"""A square wave that acts late by a part of a sample, on a stiff machine simulated here."""

from pathlib import Path

import numpy as np
import pytest

from monitor.model import EquationsPlant, RemainderSection
from monitor.observer import ObserverSignals
from monitor.observer.lateness import (
    TAU,
    input_lateness,
    late_response,
    lateness_state,
    no_lateness,
)
from monitor.observer.lateness.lateness_state import ERRORS, OF_SLOW
from monitor.observer.missing_force import HELD_LATE, LATE_UNIT, E
from monitor.signals import GOOD, NEW_BOOT
from tests.compiled import from_python
from tests.observer.lateness.followed import follow_lateness

left = from_python(lateness_state.left)
response_to = from_python(late_response.response_to)
told_lateness = from_python(input_lateness.told_lateness)

RATE, FINE, PERIOD, N = 256.0, 64, 32, 1024
NOISE = 0.05
"""Standard deviation of the acceleration's noise [m/s²]."""
BLOWN, LAG, MASS, DAMPING, STIFFNESS = 8.0, 3e-3, 0.4, 3.0, 700.0
EQUATIONS = f"""
name = "blown-flap"
summary = "A flap on a spring, pushed by a jet of air that follows its voltage with a lag."
hold = "zero"

[inputs.voltage]
unit = "V"

[quantities]
acceleration = {{ expression = "(q - c*v - k*x + load)/m", unit = "m/s^2" }}

[states.x]
unit = "m"
derivative = "v"
measured = "position"

[states.v]
unit = "m/s"
derivative = "acceleration"
rate_of = "position"

[states.q]
unit = "N"
derivative = "(G*drive - q)/lag"

[parameters]
G = {{ value = {BLOWN}, unit = "N/V", low = 1e-6, meaning = "force of the jet" }}
lag = {{ value = {LAG}, unit = "s", low = 1e-6, meaning = "lag of the jet" }}
m = {{ value = {MASS}, unit = "kg", low = 1e-6, meaning = "moving mass" }}
c = {{ value = {DAMPING}, unit = "N s/m", low = 0.0, meaning = "damping" }}
k = {{ value = {STIFFNESS}, unit = "N/m", low = 0.0, meaning = "stiffness" }}

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
variables.x = {{ expression = "x", unit = "m" }}
variables.v = {{ expression = "v", unit = "m/s" }}
"""


def recorded(late: float) -> np.ndarray:
    """Voltage, position and acceleration at the samples, shape (N, 3)."""
    voltage = np.where(np.arange(N) % PERIOD < PERIOD // 2, 1.0, -1.0)
    acts = np.roll(np.repeat(voltage, FINE), round(late * FINE))
    x = v = q = 0.0
    rows, dt = np.zeros((N, 3)), 1.0 / RATE / FINE
    for k, u in enumerate(acts):
        a = (q - DAMPING * v - STIFFNESS * x) / MASS
        if k % FINE == 0:
            rows[k // FINE] = voltage[k // FINE], x, a
        q += (BLOWN * u - q) * (1.0 - np.exp(-dt / LAG))
        v += a * dt
        x += v * dt
    rows[:, 2] += NOISE * np.random.default_rng(3).standard_normal(N)
    return rows


def judged(rows: np.ndarray, folder: Path) -> np.ndarray:
    """The judged columns of a recording, shape (n, JUDGED)."""
    equations = folder / "blown_flap.toml"
    equations.write_text(EQUATIONS)
    plant = EquationsPlant(
        model=str(equations), names=("G", "lag", "m", "c", "k"),
        values=(BLOWN, LAG, MASS, DAMPING, STIFFNESS), port="load",
    )  # fmt: skip
    none = RemainderSection(centre=(0.0,) * 3, scale=(1.0,) * 3, weights=(0.0,) * 9)
    code = np.full(len(rows), GOOD)
    code[0] = NEW_BOOT
    return ObserverSignals(plant, none, RATE).update(rows, code).judged


@pytest.mark.parametrize("late", [0.5, 0.7, 0.9])
def test_its_lateness_is_found(late: float, tmp_path: Path) -> None:
    kept = no_lateness()
    healthy = float(np.var(judged(recorded(0.0), tmp_path)[N // 2 :, E]))
    for row in judged(recorded(late), tmp_path)[32:]:
        row[LATE_UNIT] = response_to(row[LATE_UNIT], row[HELD_LATE], kept)
        follow_lateness(row, healthy, healthy, False, True, False, kept)

    # The jet has almost settled within a sample: what acts late in it counts less than its share.
    assert kept[TAU] == pytest.approx(late, abs=0.2)
    assert told_lateness(kept) == kept[TAU]
    assert left(kept[TAU], kept, OF_SLOW) < 0.02 * kept[OF_SLOW + ERRORS]
