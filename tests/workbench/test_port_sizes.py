"""Sizes of what acts at a port, to which the bounds and starting values of effects are scaled."""

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model, shipped_models
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.data import port_sizes

RATE = 500.0
TIME = np.arange(6000) / RATE


def speeds(twist: float, noise: float = 0.02) -> Recording:
    """Both speeds of a two-mass drive whose shaft is twisted by an amplitude [rad], at 3 Hz."""
    turned = 2 * np.pi * 3.0
    load = 5 * np.cos(2 * np.pi * 0.5 * TIME)
    motor = load + twist * turned * np.cos(turned * TIME)
    random = np.random.default_rng(3)
    read = np.column_stack([motor, load]) + noise * random.standard_normal((len(TIME), 2))
    return Recording(1 / RATE, np.ones((len(TIME), 1)), read)


@pytest.mark.parametrize("twist", [0.01, 0.3])
def test_a_twist_that_nobody_measures_has_the_size_of_the_travel(twist: float) -> None:
    sizes = port_sizes(shipped_models()["two-mass-drive"], speeds(twist))
    assert sizes["coupling"]["x"] == pytest.approx(twist / np.sqrt(2), rel=0.1)
    assert sizes["drive"]["x"] == pytest.approx(5 / np.pi / np.sqrt(2), rel=0.1)
    gap = library()["backlash"].scaled(sizes["coupling"]).parameters["g"]
    assert 0.05 * twist < gap.value < twist < 2 * gap.high


def test_a_measured_position_has_its_own_size() -> None:
    model = shipped_models()["mass-spring-damper"]
    read = np.column_stack([0.2 + 0.1 * np.sin(TIME), np.cos(TIME)])
    sizes = port_sizes(model, Recording(1 / RATE, np.ones((len(TIME), 1)), read))
    assert sizes["load"]["x"] == pytest.approx(np.sqrt(np.mean(read[:, 0] ** 2)))


STRUT = """
name = "strut"
summary = "two bodies on a strut, of which its travel alone is measured"
inputs.push = { unit = "N" }
states.xb = { unit = "m", derivative = "vb" }
states.vb = { unit = "m/s", derivative = "(push - pull)/m" }
states.xw = { unit = "m", derivative = "vw" }
states.vw = { unit = "m/s", derivative = "(pull - spring*xw - drag*vw + ground)/m" }
quantities.pull = { expression = "k*(xb - xw) - strut", unit = "N" }
parameters.k = { value = 40.0, unit = "N/m" }
parameters.m = { value = 1.0, unit = "kg" }
parameters.spring = { value = 50.0, unit = "N/m" }
parameters.drag = { value = 1.0, unit = "N s/m" }
outputs.travel = { unit = "m", expression = "2*(xw - xb)" }
[ports.strut]
kind = "force"
unit = "N"
variables.x = { expression = "xb - xw", unit = "m" }
variables.v = { expression = "vb - vw", unit = "m/s" }
[ports.ground]
kind = "force"
unit = "N"
variables.x = { expression = "xw", unit = "m" }
variables.v = { expression = "vw", unit = "m/s" }
"""


def test_a_measured_difference_has_its_size_and_what_nobody_measures_that_of_a_run() -> None:
    model = parse(STRUT, Model, "strut")
    push = np.sin(2 * np.pi * 2.0 * TIME)
    travel = 2 * 0.05 * np.sin(2 * np.pi * 2.0 * TIME)
    sizes = port_sizes(model, Recording(1 / RATE, push[:, None], travel[:, None]))
    assert sizes["strut"]["x"] == pytest.approx(0.05 / np.sqrt(2), rel=0.01)
    assert sizes["strut"]["v"] == pytest.approx(4 * np.pi * 0.05 / np.sqrt(2), rel=0.01)
    # A push of 1 N moves what stands on a spring of 50 N/m by some centimetres, and not by a metre.
    assert 1e-3 < sizes["ground"]["x"] < 0.1
    assert sizes["ground"]["v"] < 1.0


SERVO = """
name = "servo"
summary = "a surface that a servo turns, of which its motion alone is measured"
inputs.command = { unit = "rad" }
quantities.deflection = { expression = "d", unit = "rad" }
states.d = { unit = "rad", derivative = "(command - d)/tau" }
states.q = { unit = "rad/s", derivative = "gain*surface - q/tau", measured = "rate" }
parameters.tau = { value = 0.05, unit = "s" }
parameters.gain = { value = 1.0, unit = "1/s^2" }
outputs.rate = { unit = "rad/s", expression = "q" }
[ports.surface]
kind = "actuator"
signal = "deflection"
"""


def test_a_signal_that_nobody_measures_has_the_size_that_it_has_in_a_run() -> None:
    model = parse(SERVO, Model, "servo")
    turned = 2 * np.pi * 1.5
    command = 0.06 * np.sin(turned * TIME)
    recording = Recording(1 / RATE, command[:, None], np.zeros((len(TIME), 1)))
    size = 0.06 / np.sqrt(2) / np.hypot(1.0, 0.05 * turned)
    found = port_sizes(model, recording)["surface"]
    assert found["u"] == pytest.approx(size, rel=0.02)
    assert found["rate"] == pytest.approx(turned * size, rel=0.02)
