"""A parameter that is tiny in SI beside large ones: the compliance of oil, 1e-13 m³/Pa.

The recordings are made by Euler steps of their own, with a compliance that changes with the travel.
"""

import numpy as np
import pytest

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import compose, parse_model
from rigwatch.physics.engine.fit import Recording
from rigwatch.physics.engine.search.continued_fit import fit_continued
from rigwatch.workbench.fit.intervals import identifiability

CYLINDER = """
name = "cylinder"
summary = "A piston moved by oil, of which only the position is read."
hold = "zero"
inputs.flow = { unit = "m^3/s" }
parameters.A = { value = 6e-4, unit = "m^2", fixed = true }
parameters.m = { value = 25.0, unit = "kg", fixed = true }
parameters.b = { value = 500.0, unit = "N s/m", low = 0.0 }
parameters.Cp = { value = 2e-13, unit = "m^3/Pa", low = 1e-15 }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(A*p - b*v)/m", rate_of = "position" }
states.p = { unit = "Pa", derivative = "(flow - A*v)/Cp", low = -2e7, high = 2e7 }
outputs.position = { unit = "mm", expression = "x" }
"""
AREA, MASS, DAMPING, COMPLIANCE = 6e-4, 25.0, 900.0, 1e-12
DT, FINER, SAMPLES, NOISE = 0.005, 200, 800, 1e-5
HORIZON = 40


@pytest.fixture(scope="module")
def recording() -> Recording:
    draw = np.random.default_rng(4)
    flow = np.repeat(draw.uniform(-6e-5, 6e-5, SAMPLES // 20), 20)
    x = v = p = 0.0
    position = np.empty(SAMPLES)
    for row, own in enumerate(flow):
        position[row] = x
        for _ in range(FINER):
            p += DT / FINER * (own - AREA * v) / (COMPLIANCE * (1 + 0.5 * x))
            v += DT / FINER * (AREA * p - DAMPING * v) / MASS
            x += DT / FINER * v
    noisy = position + NOISE * draw.standard_normal(SAMPLES)
    return Recording(DT, flow[:, None], noisy[:, None])


@pytest.fixture(scope="module")
def compiled() -> CompiledSystem:
    return compile_system(compose(parse_model(CYLINDER, "test"), ()))


def test_a_compliance_of_oil_is_found(compiled: CompiledSystem, recording: Recording) -> None:
    found = fit_continued(compiled, recording, HORIZON)

    assert found.rms[0] < 1.2 * NOISE
    assert found.values()["Cp"] == pytest.approx(COMPLIANCE, rel=0.1)
    assert found.values()["b"] == pytest.approx(DAMPING, rel=0.1)
    assert not identifiability(found)
    for name, deviation in found.deviations().items():
        assert 0 < deviation < 0.1 * found.values()[name]
