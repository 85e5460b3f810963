"""Fits stay where the steps follow the model's fastest mode."""

import numpy as np
import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.compile.resolved_rates import FASTEST, resolved
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import compose

MOTOR = shipped_models()["motor"]
DT = 1 / 200


def bounds(model=MOTOR, dt=DT, **values):
    system = compose(model)
    compiled = compile_system(system)
    return resolved(system, compiled.vector(values), dt).parameters


def test_an_inductance_is_bounded_where_its_time_constant_is_a_sixteenth_of_a_sample():
    assert bounds(R=1.8)["L"].low == pytest.approx(1.8 * DT / FASTEST, rel=1e-6)
    assert bounds(R=1.8)["L"].high == MOTOR.parameters["L"].high


def test_other_bounds_stay():
    found = bounds()
    assert {n: (p.low, p.high) for n, p in found.items() if n != "L"} == {
        n: (p.low, p.high) for n, p in MOTOR.parameters.items() if n != "L"
    }


def test_a_model_that_is_faster_from_the_start_is_left_as_it_is():
    assert bounds(L=2e-5)["L"].low == MOTOR.parameters["L"].low


def test_a_rate_of_two_free_parameters_bounds_neither():
    loose = {"R": replace(MOTOR.parameters["R"], fixed=False, low=0.1)}
    model = replace(MOTOR, parameters=MOTOR.parameters | loose)
    assert bounds(model)["L"].low == MOTOR.parameters["L"].low


def test_a_rate_that_grows_with_its_parameter_bounds_it_above():
    loose = {"R": replace(MOTOR.parameters["R"], fixed=False, low=0.1, high=1e6)}
    fixed = {"L": replace(MOTOR.parameters["L"], fixed=True)}
    model = replace(MOTOR, parameters=MOTOR.parameters | loose | fixed)
    assert bounds(model)["R"].high == pytest.approx(FASTEST * 5e-3 / DT, rel=1e-6)


def test_a_mode_at_the_bound_is_followed_by_stable_steps():
    system = compose(MOTOR)
    compiled = compile_system(system)
    slow = compiled.vector({"L": bounds()["L"].low})
    ends = [
        compiled.simulate(
            np.ones((3, 1)), DT, np.zeros(1, np.int64), 3,
            initial=np.array([[0.0, current]]), parameters=slow,
        ).outputs[0, 1, 0]
        for current in (0.0, 1.0)
    ]  # fmt: skip
    # The initial current gives the rotor K·L/R·i at once, and nothing later.
    assert ends[1] - ends[0] == pytest.approx(0.1 * slow[2] / 1.0 / 1e-3, rel=0.05)
