"""Ports whose variables contain what enters there, as the current of a drive's own voltage."""

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.model_check import check_model
from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.physics.engine.equations.system import Placement, System, compose
from rigwatch.wire.typed_files.loading import parse

MOTOR = """
name = "motor"
summary = "A motor without inductance."
inputs.u = { unit = "V" }
parameters.R = { value = 2.0, unit = "ohm" }
parameters.K = { value = 0.1, unit = "V s" }
parameters.D = { value = 0.05, unit = "N m s" }
parameters.J = { value = 0.01, unit = "kg m^2" }
quantities.current = { expression = "(drive - K*w)/R", unit = "A" }
states.w = { unit = "1/s", derivative = "(K*current + bearing)/J", measured = "speed" }
outputs.speed = { unit = "1/s", expression = "w" }

[ports.drive]
kind = "actuator"
signal = "u"
variables.i = { expression = "CURRENT", unit = "A" }

[ports.bearing]
kind = "force"
unit = "N m"
variables.v = { expression = "w + bearing/D", unit = "1/s" }
variables.L = { expression = "K*current + bearing", unit = "N m" }
"""


def _placed(port: str, name: str, current: str = "current") -> System:
    model = parse(MOTOR.replace("CURRENT", current), Model, "motor.toml")
    check_model(model)
    return compose(model, [Placement(name, library()[name], port)])


def _rate(system: System, state: str = "w", **values: float) -> float:
    """Rate of a state at 12 V and 30/s, with values of an effect's parameters."""
    given = {name: p.value for name, p in system.parameters.items()} | {"u": 12.0, "w": 30.0}
    given |= values | dict.fromkeys(system.probes, 0.0)
    return float(system.derivatives[state].subs({symbol(n): v for n, v in given.items()}))


@pytest.mark.parametrize("current", ["current", "(drive - K*w)/R"])
def test_a_resistance_in_series_adds_to_that_of_the_winding(current: str) -> None:
    system = _placed("drive", "series_resistance", current)

    found = _rate(system, drive_series_resistance_r=0.5)
    assert found == pytest.approx(0.1 * (12.0 - 0.1 * 30.0) / (2.0 + 0.5) / 0.01)


def test_a_supply_sags_by_the_current_that_flows() -> None:
    found = _rate(_placed("drive", "supply_sag"), drive_supply_sag_s=0.01)

    current = found * 0.01 / 0.1
    assert current == pytest.approx((12.0 - 0.01 * 12.0**2 * current - 0.1 * 30.0) / 2.0)


def test_a_limit_acts_on_the_current_that_would_flow() -> None:
    values = {"drive_current_limit_r": 2.0, "drive_current_limit_im": 1.5}

    assert _rate(_placed("drive", "current_limit"), **values) == pytest.approx(0.1 * 1.5 / 0.01)


def test_a_bearing_that_yields_by_its_own_torque_is_solved_for() -> None:
    found = _rate(_placed("bearing", "viscous"), bearing_viscous_d=0.02)

    push = 0.1 * (12.0 - 0.1 * 30.0) / 2.0
    assert found == pytest.approx((push - 30.0 / (1 / 0.02 + 1 / 0.05)) / 0.01)


def test_friction_reads_the_load_that_would_press_without_it() -> None:
    found = _rate(_placed("bearing", "load_dependent"), bearing_load_dependent_mu=0.3)

    assert found == pytest.approx((1 - 0.3) * 0.1 * (12.0 - 0.1 * 30.0) / 2.0 / 0.01)


def test_what_an_effect_remembers_follows_what_enters() -> None:
    prefix = "bearing_maxwell_element_"
    system = _placed("bearing", "maxwell_element")
    values = {prefix + "d": 0.02, prefix + "tau": 0.5, prefix + "z": 10.0}

    found = _rate(system, prefix + "z", **values)
    assert found == pytest.approx((30.0 - 0.02 * 10.0 / 0.05 - 10.0) / 0.5)


def test_without_effects_nothing_changes() -> None:
    plain = parse(MOTOR.replace("CURRENT", "(u - K*w)/R"), Model, "motor.toml")
    same = parse(MOTOR.replace("CURRENT", "current"), Model, "motor.toml")

    assert compose(plain).derivatives == compose(same).derivatives
    assert np.isclose(_rate(compose(same)), 0.1 * 9.0 / 2.0 / 0.01)
