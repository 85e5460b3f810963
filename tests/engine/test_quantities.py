"""Quantities of a model file: names for expressions, which change no number."""

import numpy as np
import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.measured_motion import (
    along_measured_motion,
    balanced_states,
    predicted_outputs,
)
from rigwatch.physics.engine.equations.model import Model, Quantity, shipped_models
from rigwatch.physics.engine.equations.model_check import check_model
from rigwatch.physics.engine.equations.quantities import spelt_out
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files.loading import parse

CRANE = """
name = "crane"
summary = "A mass that an actuator's pressure moves."
inputs.u = { unit = "V" }
parameters.m = { value = 2.0, unit = "kg" }
parameters.k = { value = 50.0, unit = "N/m" }
parameters.A = { value = 3.0, unit = "N/V" }
parameters.T = { value = 0.05, unit = "s" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "BALANCE", rate_of = "position" }
states.f = { unit = "N", derivative = "(A*drive - f)/T" }
outputs.position = { unit = "m", expression = "x" }
outputs.acceleration = { unit = "m/s^2", expression = "BALANCE" }

[ports.drive]
kind = "actuator"
signal = "u"

[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
variables.L = { expression = "LOAD", unit = "N" }
"""
NAMED = """
[quantities]
acceleration_of_mass = { expression = "balance/m", unit = "m/s^2" }
balance = { expression = "push + load", unit = "N" }
push = { expression = "f - spring", unit = "N" }
spring = { expression = "k*x", unit = "N" }
"""


def _crane(balance: str, load: str, more: str = "") -> Model:
    text = CRANE.replace("BALANCE", balance).replace("LOAD", load)
    return parse(text + more, Model, "crane.toml")


def _named(**changed: str) -> Model:
    model = _crane("acceleration_of_mass", "push", NAMED)
    more = {n: Quantity(expression=text, unit="N") for n, text in changed.items()}
    return replace(model, quantities=model.quantities | more)


def _run(model: Model) -> tuple[FloatArray, FloatArray]:
    placed = Placement("load_dependent", library()["load_dependent"], "load")
    compiled = compile_system(compose(model, [placed]))
    u = np.sin(np.arange(400) * 0.07)[:, None]
    values = compiled.vector({"load_load_dependent_mu": 0.2})
    run = compiled.simulate(
        u, 0.01, np.array([0]), 400, initial=np.array([[0.01, 0, 1]]), parameters=values
    )
    return run.outputs, run.slopes


def test_names_change_no_number() -> None:
    plain = _crane("(f - k*x + load)/m", "f - k*x")

    for of_names, of_text in zip(_run(_named()), _run(plain), strict=True):
        assert np.array_equal(of_names, of_text)
        assert np.ptp(of_text) > 0


@pytest.mark.parametrize("name", [n for n, m in shipped_models().items() if m.quantities])
def test_a_shipped_model_is_the_same_with_its_quantities_spelt_out(name: str) -> None:
    named, spelt = compose(shipped_models()[name]), compose(spelt_out(shipped_models()[name]))
    signals = {port.signal for port in named.model.ports.values()}

    assert set(spelt.model.quantities) == signals & set(named.model.quantities)
    assert named.derivatives == spelt.derivatives
    assert named.outputs == spelt.outputs


def test_measured_motion_sees_through_names() -> None:
    model = _named()

    assert [state.name for state in balanced_states(model)] == ["v"]
    assert predicted_outputs(model) == ("acceleration",)
    assert not along_measured_motion(model).parameters["m"].fixed
    assert list(along_measured_motion(model).states) == ["f"]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"spring": "k*x + 0.1*push"},
            r"quantities: found the circular definition \w+ uses \w+ uses \w+,",
        ),
        (
            {"spring": "k*x + 0.1*spring"},
            "quantities: found the circular definition spring uses spring,",
        ),
        ({"spring": "k*y"}, "quantity spring: found the unknown name 'y'"),
        ({"spring": "k*v"}, r"quantity spring: found 'k\*v' in .*, expected .*"),
        ({"x": "k*x"}, "quantities.x: found 'x' again after states.x"),
        ({"t": "k*x"}, "quantities.t: found a name that equations use for something else"),
        ({"spring": "k*x*(1 +"}, "quantity spring: found .* which breaks off"),
    ],
)
def test_a_slip_is_one_line(changed: dict[str, str], said: str) -> None:
    with pytest.raises(ModelError, match=said) as found:
        check_model(_named(**changed))
    assert "\n" not in str(found.value)


def test_of_ports_that_wait_for_each_other_one_is_told() -> None:
    model = _named(push="f - spring + 0.1*winding")
    port = replace(model.ports["load"], variables={}, passive=True)
    waits = replace(port, variables={"L": Quantity(expression="push", unit="N")})
    drawn = replace(port, variables={"L": Quantity(expression="f + load", unit="N")})
    ports = model.ports | {"load": waits, "winding": drawn}

    with pytest.raises(ModelError, match="port load: variable L: found 'push', which depends on"):
        check_model(replace(model, ports=ports))


def test_quantities_that_grow_beyond_measure_are_refused() -> None:
    grown = {f"q{n}": f"q{n - 1} + sin(q{n - 1}/f)*q{n - 1}" for n in range(1, 40)}

    with pytest.raises(ModelError, match=r"quantity q\d+: found \d+ characters once"):
        check_model(_named(q0="f", **grown))
