"""A model that somebody has just written: its slips are one line, its ports suffice."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.model_check import check_model
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.study import Study
from tests.workbench.machine import studied

SPEED = """
name = "motor"
summary = "Speed of a motor by its voltage; no channel shows an angle."
inputs.u = { unit = "V", hold = "zero" }
states.v = { unit = "rad/s", derivative = "-a*v + b*u + load", measured = "v" }
parameters.a = { value = 1.0, unit = "1/s" }
parameters.b = { value = 1.0, unit = "rad/(s^2*V)" }
outputs.v = { unit = "rad/s", expression = "v" }
"""
PORT = """
[ports.load]
kind = "force"
unit = "rad/s^2"
variables.v = { expression = "v", unit = "rad/s" }
"""
UNITS = {"u": "V", "v": "rad/s"}


def run(seed: int, samples: int = 1500) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)
    u = np.repeat(generator.normal(size=samples // 50), 50)
    v = np.zeros(samples)
    for i in range(1, samples):
        for _ in range(10):
            last = v[i] if _ else v[i - 1]
            v[i] = last + 0.001 * (-2 * last + 3 * u[i - 1] - 0.8 * np.tanh(last / 0.02))
    return {"u": u, "v": v + 0.005 * generator.normal(size=samples)}


def motor(folder: Path, model: str, keys: str = "") -> Study:
    return studied(folder, model, [run(0)], [run(1)], UNITS, keys)


def test_a_model_of_a_speed_needs_no_angle(tmp_path: Path) -> None:
    found = explain(motor(tmp_path, SPEED + PORT))
    assert (found.ranking[0].effect, found.ranking[0].port) == ("coulomb", "load")
    assert "dahl" in {row.effect for row in found.ranking}


def test_without_ports_it_is_compared_and_explain_asks_for_one(tmp_path: Path) -> None:
    study = motor(tmp_path, SPEED.replace(" + load", ""))
    found = compare(study)
    # The dry friction that the model lacks.
    assert found.held_out_error > 5 * found.noise_floor
    with pytest.raises(ModelError, match="found no port, expected one where effects may enter"):
        explain(study)


def test_with_a_port_that_no_effect_suits_the_error_is_unknown(tmp_path: Path) -> None:
    bare = PORT.replace('variables.v = { expression = "v", unit = "rad/s" }', "passive = true")
    found = explain(motor(tmp_path, SPEED + bare))
    assert found.verdict == "unknown_effect"
    assert not found.ranking
    assert "no further known effect suits the model's ports" in found.text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" + load", "", r"ports.load: found in no equation.*expected '… \+ load' in a derivative"),
        ("a*v", "a*vv", "state v: found the unknown name 'vv', expected 'v'"),
        ("-a*v", "-v", r"state v: found '-v \+ b \* u \+ load' with units|one unit"),
        (
            '"v", unit = "rad/s" }\n',
            '"w", unit = "rad/s" }\n',
            "variable v: found the unknown name",
        ),
        ("b*u", "b*u^2", r"write \*\* for a power"),
        ("parameters.a", "parameters.exp", "parameters.exp: found a name that equations use"),
        ("parameters.a", "parameters.lambda", "parameters.lambda: found a name that equations use"),
        ("parameters.a", "parameters.v", "parameters.v: found 'v' again after states.v"),
        ('measured = "v"', 'measured = "vel"', "states.v.measured: found channel 'vel'.*: u, v"),
        (
            'measured = "v"',
            'measured = "u"',
            "states.v.measured: found channel 'u' in V for a state in rad/s, expected one unit",
        ),
        (
            'measured = "v"',
            'rate_of = "v"',
            "states.v.rate_of: found channel 'v' in rad/s .*, expected `measured`",
        ),
        (
            'outputs.v = { unit = "rad/s", expression = "v" }',
            'outputs.v = { unit = "rad", expression = "v/a" }',
            "states.v.measured: found channel 'v' in rad for a state in rad/s, expected `rate_of`",
        ),
        (
            "a = { value = 1.0",
            "a = { low = 3.0, value = 1.0",
            "parameters.a: found value = 1 1/s, expected at least 3 1/s",
        ),
        (
            "a = { value = 1.0",
            "a = { low = 3.0, high = 2.0, value = 2.5",
            "parameters.a: found low = 3 and high = 2, expected low below high",
        ),
    ],
)
def test_a_slip_is_reported_when_the_study_is_made(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = (SPEED + PORT).replace(old, new)
    with pytest.raises(ModelError, match=message) as error:
        motor(tmp_path, text)
    assert "model.toml" in str(error.value)
    assert not (tmp_path / "study" / "study.toml").exists()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("start = { a = -2.0 }", r"study.toml: start.a: found -2, expected at least 0 1/s"),
        ("start = { a = 80.0 }", r"study.toml: start.a: found 80, expected at most 60 1/s"),
    ],
)
def test_a_known_value_out_of_its_bounds_is_refused(
    tmp_path: Path, keys: str, message: str
) -> None:
    bounded = (SPEED + PORT).replace("a = { value = 1.0", "a = { low = 0.0, high = 60, value = 1.0")
    with pytest.raises(ConfigError, match=message):
        motor(tmp_path, bounded, keys)
    motor(tmp_path / "kept", bounded, "start = { a = 60.0 }")


def test_an_actuator_that_no_equation_uses_is_reported(tmp_path: Path) -> None:
    port = '[ports.drive]\nkind = "actuator"\nsignal = "u"\n'
    with pytest.raises(ModelError, match=r"ports.drive: found in no equation"):
        motor(tmp_path, SPEED.replace(" + load", "") + port)


def test_every_shipped_model_passes() -> None:
    for model in shipped_models().values():
        check_model(model)


def test_what_fills_no_horizon_is_reported(tmp_path: Path) -> None:
    found = compare(motor(tmp_path, SPEED + PORT, "horizon = 0.7"))
    said = "train: the last 0.3 s of a recording are not counted, since they fill no horizon of 0.7"
    assert any(said in remark for remark in found.remarks)
