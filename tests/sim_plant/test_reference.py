"""The kernel against SciPy's adaptive solver on the same rig, as in docs/theory.md 1.1."""

import numpy as np
import pytest
from msgspec import structs
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sim_plant.parameters import RigParameters
from sim_plant.rig import Rig

from .rig_runs import RATE, sine

P = structs.replace(RigParameters(), centring_gain=0.0)
GAMMA = P.heat_capacity_ratio
PSI_2 = np.sqrt(GAMMA * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (GAMMA - 1)))


def flow(a: float, b: float, area_mm2: float, resistance: float) -> float:
    """w from pressure a to b: a - b = r w / mean + (w / c)^2 / downstream, solved numerically."""
    if a < b:
        return -flow(b, a, area_mm2, resistance)
    c = 2 * PSI_2 * P.discharge * area_mm2 * 1e-6 * np.sqrt(287.05 * P.temperature)
    b = max(b, a / 2)
    if a - b < 1e-6:
        return 0.0
    most = (a - b) * (a + b) / 2 / resistance

    def too_much(w: float) -> float:
        return resistance * w / ((a + b) / 2) + (w / c) ** 2 / b - (a - b)

    return float(brentq(too_much, 0.0, most, xtol=1e-12, rtol=1e-12))


def slopes(t: float, y: NDArray[np.float64], volts: float, null: float) -> list[float]:
    x, v, p1, p2, u, du = y
    w = 2 * np.pi * P.valve_frequency
    lift = null + P.pressure_per_volt * u
    a1, a2 = P.piston_area, P.annulus_area
    across = flow(p1, p2, P.piston_leak, P.leak_resistance)
    into_1 = flow(P.mean_pressure + lift, p1, P.port_area, P.port_resistance) - across
    into_2 = flow(P.mean_pressure - lift, p2, P.port_area, P.port_resistance) + across
    push = p1 * a1 - p2 * a2 - P.atmosphere * (a1 - a2) - P.piston_viscous * v
    return [
        v,
        push / (P.piston_mass + P.load_mass),
        GAMMA * (into_1 - p1 * a1 * v) / (P.dead_volume + a1 * (P.stroke / 2 + x)),
        GAMMA * (into_2 + p2 * a2 * v) / (P.dead_volume + a2 * (P.stroke / 2 - x)),
        du,
        w**2 * (volts - u) - 2 * P.valve_damping * w * du,
    ]


@pytest.fixture(scope="module")
def reference() -> NDArray[np.float64]:
    """x, v, P1, P2 at the samples of one second of a 1.4 V sine."""
    first = Rig(P, seed=0).advance(np.zeros(1)).truth
    null = (first["Pu1"][0] - first["Pu2"][0]) / 2
    y = np.array([0.0, 0.0, first["P1"][0], first["P2"][0], 0.0, 0.0])
    rows = []
    for volts in sine(1.4, 8.0, 1.0):
        rows.append(y[:4])
        y = solve_ivp(slopes, (0, 1 / RATE), y, args=(volts, null), rtol=1e-8, atol=1e-9).y[:, -1]
    return np.array(rows)


@pytest.mark.nightly
def test_kernel_agrees_with_an_adaptive_solver(reference):
    truth = Rig(P, seed=0).advance(sine(1.4, 8.0, 1.0)).truth
    for column, name in enumerate(("x", "v", "P1", "P2")):
        expected = reference[:, column]
        error = np.sqrt(np.mean((truth[name] - expected) ** 2))
        assert error < 0.007 * np.std(expected), name


def test_error_shrinks_with_the_step(reference):
    def error(substeps: int) -> float:
        p = structs.replace(P, substeps=substeps)
        truth = Rig(p, seed=0).advance(sine(1.4, 8.0, 1.0)).truth
        return float(np.sqrt(np.mean((truth["v"] - reference[:, 1]) ** 2)))

    assert error(64) < 0.35 * error(16)
