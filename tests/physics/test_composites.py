"""Composites: an effect behind another, declared in one place and compiled like any other."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import (
    Placement,
    compose,
    library,
    model_named,
    parse_effects,
    symbol,
)
from rigwatch.wire.errors import ConfigError, ModelError

OWN = """
[maps.gear]
physics = "A gear between the port and what is behind it."
variables.x = "x/n"
variables.v = "v/n"
parameters.n = { unit = "1", value = 4.0 }

[effects.spring]
port = "force"
expression = "-k*x"
physics = "A spring."
source = "here"
parameters.k = { unit = "{F}/{x}", role = "strength" }

[effects.stiffening]
port = "force"
expression = "-k*x - n*x**3"
physics = "A spring that stiffens."
source = "here"
parameters.k = { unit = "{F}/{x}", role = "strength" }
parameters.n = { unit = "{F}/{x}^3", value = 2.0 }

[composites.geared_spring]
first = "gear"
then = "spring"
physics = "A spring behind a gear."
source = "here"
"""


def again(text: str) -> str:
    """The file with another composite."""
    return f"{OWN}\n[composites.other]\nphysics = 'p'\nsource = 's'\n{text}"


def force(name: str, text: str, states: dict[str, float], **parameters: float) -> float:
    """An effect's force at the load of a mass, at one state and with given parameters."""
    effect = parse_effects(text, "own.toml")[name]
    system = compose(model_named("mass-spring-damper"), [Placement(name, effect, "load")])
    values = {f"load_{name}_{key}": value for key, value in parameters.items()} | states
    symbols = system.ports["load"].free_symbols
    known = {each: values[str(each)] for each in symbols if str(each) in values}
    return float(system.ports["load"].subs(known).subs(symbol("probe_load"), 0.0))


def test_an_effect_behind_a_map_sees_the_mapped_variables() -> None:
    assert force("geared_spring", OWN, {"x": 2.0}, k=3.0, n=4.0) == pytest.approx(-3.0 * 2.0 / 4.0)


def test_names_of_both_parts_are_told_apart() -> None:
    text = again("first = 'gear'\nthen = 'stiffening'")
    found = force("other", text, {"x": 2.0}, k=3.0, gear_n=4.0, stiffening_n=2.0)
    assert found == pytest.approx(-3.0 * 0.5 - 2.0 * 0.5**3)


def test_a_signal_passes_both_parts_in_their_order() -> None:
    """A step through a lag of 0.2 s, then late by 0.3 s."""
    effect = library()["delay_after_lag"]
    system = compose(model_named("motor"), [Placement("delay_after_lag", effect, "speed_sensor")])
    compiled = compile_system(system)
    parameters = compiled.vector(
        {"speed_sensor_delay_after_lag_lag_tau": 0.2, "speed_sensor_delay_after_lag_delay_tau": 0.3}
    )
    # The motor turns at a constant speed, so that only the sensor's states move.
    values = dict(zip(system.parameters, parameters.tolist(), strict=True))
    speed = 10.0
    current = values["b"] * speed / values["K"]
    voltage = values["R"] * current + values["K"] * speed
    initial = np.zeros((1, len(system.states)))
    initial[0, :2] = [speed, current]
    run = compiled.simulate(
        np.full((400, 1), voltage), 0.005, np.zeros(1, np.int64), 400, initial=initial,
        parameters=parameters, substeps=4,
    )  # fmt: skip
    time = 0.005 * np.arange(400)
    exact = np.where(time > 0.3, speed * (1 - np.exp(-(time - 0.3) / 0.2)), 0.0)
    rest = np.abs(run.outputs[0, :, 0] - exact)
    assert rest[time > 0.7].max() < 0.02 * speed
    assert np.sqrt(np.mean(rest**2)) < 0.05 * speed


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "first = 'gap'\nthen = 'spring'",
            r"composites.other.first: found 'gap', expected",
        ),
        ("first = 'gear'\nthen = 'sprig'", r"composites.other.then: found 'sprig', expected the"),
        ("first = 'gear'\nthen = 'lag'", r"composites.other.then: found lag of kind signal"),
        ("first = 'lag'\nthen = 'spring'", r"composites.other.then: found 'spring', expected an"),
        ("first = 'lag'\nthen = 'rate_limit'", r"then: found rate_limit, which uses left"),
        ("first = 'lag'\nthen = 'digital_smoothing'", r"found 'digital_smoothing', expected an"),
        (
            "first = 'gear'\nthen = 'spring'\ntried = { w = [1.0] }",
            r"found 'w', expected",
        ),
    ],
)
def test_parts_that_cannot_be_in_series_are_refused(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_effects(again(text), "own.toml")


def test_a_variable_that_the_map_does_not_give_is_refused() -> None:
    text = again("first = 'gear'\nthen = 'spring'").replace('variables.x = "x/n"\n', "")
    with pytest.raises(ConfigError, match=r"found no x in gear, which spring uses"):
        parse_effects(text, "own.toml")


def test_units_of_a_composite_are_checked() -> None:
    text = OWN.replace('variables.x = "x/n"', 'variables.x = "x*v"')
    with pytest.raises(ModelError, match="expected"):
        force("geared_spring", text, {"x": 2.0}, k=3.0, n=4.0)


def test_a_name_stands_for_one_effect() -> None:
    with pytest.raises(ConfigError, match=r"composites.spring: found an effect of this name"):
        parse_effects(OWN.replace("geared_spring", "spring"), "own.toml")
