"""Effects of a signal that the equations compute, such as the voltage of a controller."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import (
    Model,
    Placement,
    along_measured_motion,
    check_model,
    compose,
    hold_at,
    library,
    parse_model,
    spelt_out,
)
from rigwatch.physics.engine.score import suits
from rigwatch.wire.errors import ModelError

SERVO = """
name = "servo"
summary = "A motor that turns an arm to a goal; its controller is in the equations."
inputs.goal = { unit = "rad", hold = "zero" }
quantities.wanted = { expression = "kp*(aim - x)", unit = "V" }
quantities.push = { expression = "K*drive", unit = "N m" }
states.x = { unit = "rad", derivative = "v", measured = "angle" }
states.v = { unit = "rad/s", derivative = "(push - b*v + gear)/J", rate_of = "angle" }
parameters.kp = { value = 4.0, unit = "V/rad" }
parameters.K = { value = 0.5, unit = "N m/V", fixed = true }
parameters.b = { value = 0.2, unit = "N m s/rad" }
parameters.J = { value = 0.05, unit = "kg m^2" }
outputs.angle = { unit = "rad", expression = "x" }

[ports.drive]
kind = "actuator"
signal = "wanted"

[ports.aim]
kind = "actuator"
signal = "goal"

[ports.gear]
kind = "force"
unit = "N m"
variables.v = { expression = "v", unit = "rad/s" }
variables.L = { expression = "push", unit = "N m" }
"""


def _servo(old: str = "", new: str = "") -> Model:
    assert old in SERVO
    return parse_model(SERVO.replace(old, new), "servo.toml")


def _placed(effect: str) -> Placement:
    return Placement(effect, library()[effect].scaled({"u": 1.0, "rate": 1.0, "dt": 0.01}), "drive")


def _angle(model: Model, effect: str, **values: float) -> np.ndarray:
    """The angle after a step of the goal of 1 rad, sampled at 100 Hz."""
    compiled = compile_system(compose(model, [_placed(effect)]))
    whole = {f"drive_{effect}_{name}": value for name, value in values.items()}
    goal, states = np.ones((200, 1)), len(compiled.system.states)
    run = compiled.simulate(
        goal, 0.01, np.zeros(1, np.int64), 200, initial=np.zeros((1, states)),
        parameters=compiled.vector(whole), substeps=8,
    )  # fmt: skip
    return np.asarray(run.outputs[0, :, 0])


def _stepped(limit: float, tau: float) -> np.ndarray:
    """The same loop integrated here, the voltage limited and late by a first-order lag."""
    x = v = late = 0.0
    angles = []
    for k in range(20000):
        if k % 100 == 0:
            angles.append(x)
        asked = 4.0 * (1.0 - x)
        late = asked if tau == 0 else late + 1e-4 * (asked - late) / tau
        torque = 0.5 * min(max(late, -limit), limit)
        x, v = x + 1e-4 * v, v + 1e-4 * (torque - 0.2 * v) / 0.05
    return np.array(angles)


def test_an_effect_acts_within_the_loop() -> None:
    limited = _angle(_servo(), "saturation", w=1.0, us=1.5)
    assert limited == pytest.approx(_stepped(1.5, 0.0), abs=2e-3)
    late = _angle(_servo(), "lag", tau=0.03)
    assert late == pytest.approx(_stepped(1e9, 0.03), abs=2e-3)
    assert np.max(np.abs(limited - late)) > 0.1


def test_every_effect_of_an_actuator_is_offered_and_keeps_its_units() -> None:
    model = check_model(_servo(), "servo.toml").model
    offered = {n for n, effect in library().items() if suits(effect, model.ports["drive"], model)}
    held = {n for n, effect in library().items() if suits(effect, model.ports["aim"], model)}
    # The controller's voltage moves between samples: what acts on kept samples cannot be there.
    assert offered == {name for name in held if not library()[name].sampled}
    assert {"saturation", "dead_band", "lag", "gain", "delay", "rate_limit"} <= offered
    for name in offered:
        assert "drive" in compose(model, [_placed(name)]).ports, name
    band = compose(model, [_placed("dead_band")]).parameters["drive_dead_band_b"]
    assert band.unit == "V"


def test_the_signal_remains_when_quantities_are_spelt_out_and_along_the_motion() -> None:
    alone = spelt_out(_servo())
    assert list(alone.quantities) == ["wanted"]
    along = along_measured_motion(_servo())
    assert not along.parameters["kp"].fixed
    row = np.array([[1.0, 0.25, 0.5]])
    compiled = compile_system(compose(along))
    run = compiled.simulate(
        row, 0.01, np.zeros(1, np.int64), 1, initial=np.zeros((1, 0)),
        parameters=compiled.parameters, substeps=1,
    )  # fmt: skip
    assert run.outputs[0, 0, 0] == pytest.approx((0.5 * 4.0 * 0.75 - 0.2 * 0.5) / 0.05)


def test_what_held_inputs_alone_determine_is_held() -> None:
    assert hold_at(_servo(), _servo().ports["drive"]) == "linear"
    open_loop = _servo("kp*(aim - x)", "kp*aim")
    assert hold_at(open_loop, open_loop.ports["drive"]) == "zero"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('signal = "wanted"', 'signal = "wnted"', "found signal 'wnted', expected one of goal, w"),
        ('signal = "wanted"', 'signal = "push"', "found signal 'push', which depends on what ent"),
        ("K*drive", "K*wanted", "ports.drive: found in no equation.*its signal's place taken by"),
        ('(aim - x)", unit = "V"', '(aim - x)", unit = "A"', "quantity wanted: .*expected A"),
    ],
)  # fmt: skip
def test_a_slip_is_one_line(old: str, new: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        check_model(_servo(old, new), "servo.toml")
