"""What a machine was told to do is not taken for what it has done."""

import pytest

from rigwatch.physics.engine.equations.model import Model, parse_model
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.steps.log_columns import matched

SERVO = """
name = "servo"
summary = "A shaft that follows a set angle."
[inputs.goal]
unit = "rad"
[states.x]
unit = "rad"
derivative = "w"
measured = "angle"
[states.w]
unit = "rad/s"
derivative = "k*(goal - x) - c*w"
measured = "speed"
[parameters.k]
value = 1.0
unit = "1/s^2"
[parameters.c]
value = 1.0
unit = "1/s"
[outputs.angle]
unit = "rad"
expression = "x"
[outputs.speed]
unit = "rad/s"
expression = "w"
"""
TWO_SHAFTS = """
name = "two-shafts"
summary = "A load behind a gear."
[inputs.torque]
unit = "N m"
[states.a]
unit = "rad"
derivative = "w"
measured = "motor_angle"
[states.b]
unit = "rad"
derivative = "v"
measured = "load_angle"
[states.w]
unit = "rad/s"
derivative = "(torque - k*(a - b))/J"
[states.v]
unit = "rad/s"
derivative = "k*(a - b)/J"
measured = "{speed}"
[parameters.k]
value = 1.0
unit = "N m/rad"
[parameters.J]
value = 1.0
unit = "kg m^2"
[outputs.motor_angle]
unit = "rad"
expression = "a"
[outputs.load_angle]
unit = "rad"
expression = "b"
[outputs.{speed}]
unit = "rad/s"
expression = "v"
"""
ANGLES = ["time [s]", "torque [N m]", "motor_angle [rad]", "load_angle [rad]"]


def servo(drive: str = "goal") -> Model:
    return parse_model(SERVO.replace("goal", drive), "servo.toml")


def two_shafts(speed: str) -> Model:
    return parse_model(TWO_SHAFTS.replace("{speed}", speed), "shafts.toml")


def test_a_measured_speed_is_not_the_rate_of_what_was_commanded() -> None:
    found = matched(["time [s]", "goal [rad]", "angle [rad]"], servo(), {})
    assert found.rates == {"speed": ("angle", 1)}
    with pytest.raises(ModelError, match="no unique column for angle"):
        matched(["time [s]", "goal [rad]"], servo(), {})


def test_a_speed_that_may_be_the_rate_of_two_channels_is_asked_for() -> None:
    with pytest.raises(ModelError, match="the rate of motor_angle or load_angle"):
        matched(ANGLES, two_shafts("speed"), {})
    found = matched(ANGLES, two_shafts("load_speed"), {})
    assert found.rates == {"load_speed": ("load_angle", 1)}


@pytest.mark.parametrize("word", ["ref", "Setpoint", "cmd", "target"])
def test_a_set_value_is_no_output(word: str) -> None:
    columns = ["time [s]", "goal [rad]", "angle [rad]", f"speed {word} [rad/s]"]
    found = matched([*columns, "omega [deg/s]"], servo(), {})
    assert found.channels["speed"] == "omega [deg/s][deg/s]"
    # Alone it is neither: the speed is that of the measured angle.
    assert matched(columns, servo(), {}).rates == {"speed": ("angle", 1)}
    # An input is what it should be.
    found = matched(["time [s]", f"u {word} [rad]", "angle [rad]"], servo("u"), {})
    assert found.channels["u"] == f"u {word} [rad][rad]"


def test_a_letter_is_no_part_of_a_word() -> None:
    with pytest.raises(ModelError, match="no unique column for u"):
        matched(["time", "current", "angle", "speed"], servo("u"), {})
    found = matched(["time", "u 1", "angle", "speed"], servo("u"), {})
    assert found.channels["u"] == "u 1[rad]"


def test_columns_that_suit_several_signals_are_told_once() -> None:
    with pytest.raises(ModelError) as told:
        matched(["time [s]", "torque [N m]", "a1 [rad]", "b1 [rad]"], two_shafts("speed"), {})
    options = str(told.value).partition("expected ")[2]
    assert options == (
        "--map 'motor_angle=COLUMN' --map 'load_angle=COLUMN', COLUMN being 'a1 [rad]' or"
        " 'b1 [rad]'; --map 'speed=COLUMN[rad/s]'"
    )
