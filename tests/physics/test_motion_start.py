"""A fit over windows, with states that no channel shows, begins along the measured motion."""

import numpy as np
import pytest
from scipy.signal import cont2discrete

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations import library
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.search.motion_start import motion_start
from rigwatch.physics.engine.search.multi_start_fit import multi_start_fit
from rigwatch.physics.engine.search.short_horizons import ShortHorizons
from rigwatch.wire.typed_files.loading import parse

DT, SAMPLES = 1 / 256, 2048
M, C, K, GAIN, FAST, SLOW = 0.5, 2.0, 300.0, 8.0, 60.0, 5.0
DRIVEN = """
name = "driven"
summary = "a mass on a spring, pushed by two stages that no channel shows"
hold = "zero"
inputs.voltage = { unit = "V" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(f - c*v - k*x + load)/m", rate_of = "position" }
states.f = { unit = "N", derivative = "fast*(s - f)" }
states.s = { unit = "N", derivative = "slow*(g*drive - s)" }
parameters.m = { value = 0.5, unit = "kg", low = 1e-3, fixed = true }
parameters.c = { value = 1e-2, unit = "N s/m", low = 1e-6 }
parameters.k = { value = 1.0, unit = "N/m", low = 1e-6 }
parameters.g = { value = 0.1, unit = "N/V", low = 1e-6 }
parameters.fast = { value = 600.0, unit = "1/s", low = 1e-2 }
parameters.slow = { value = 100.0, unit = "1/s", low = 1e-2 }
outputs.position = { unit = "m", expression = "x" }
outputs.acceleration = { unit = "m/s^2", expression = "(f - c*v - k*x + load)/m" }
ports.drive = { kind = "actuator", signal = "voltage" }
ports.load = { kind = "force", unit = "N", variables = { x = { expression = "x", unit = "m" }, v = { expression = "v", unit = "m/s" } } }
ports.position_sensor = { kind = "sensor", signal = "position" }
"""  # noqa: E501 -- a table of TOML


def driven(*placements):
    return compile_system(compose(parse(DRIVEN, Model, "driven"), placements))


def recorded():
    """The machine's motion from its exact discrete form, with noise on both channels."""
    generator = np.random.default_rng(3)
    steps = np.repeat(generator.normal(size=SAMPLES // 8), 8)
    a = np.array([
        [0, 1, 0, 0], [-K / M, -C / M, 1 / M, 0], [0, 0, -FAST, FAST], [0, 0, 0, -SLOW],
    ])  # fmt: skip
    b = np.array([[0.0], [0.0], [0.0], [SLOW * GAIN]])
    read = np.array([[1, 0, 0, 0], a[1]])
    ad, bd, *_ = cont2discrete((a, b, read, np.zeros((2, 1))), DT)
    state, found = np.zeros(4), np.empty((SAMPLES, 2))
    for k, volts in enumerate(steps):
        found[k] = read @ state
        state = ad @ state + bd[:, 0] * volts
    noise = 2e-3 * found.std(axis=0)
    return Recording(DT, steps[:, None], found + noise * generator.normal(size=found.shape)), noise


def test_from_far_values_it_ends_near_the_true_ones():
    recording, noise = recorded()
    compiled = driven()
    found = motion_start(compiled, recording, compiled.parameters, noise, 2)
    values = dict(zip(compiled.system.parameters, found, strict=True))
    true = {"c": C, "k": K, "g": GAIN}
    assert {n: values[n] for n in true} == pytest.approx(true, rel=0.15)
    # Which of the two stages is the slow one does not show.
    assert sorted([values["fast"], values["slow"]]) == pytest.approx([SLOW, FAST], rel=0.15)
    assert values["m"] == M


def test_the_windows_are_fitted_from_there():
    recording, noise = recorded()
    search = ShortHorizons(
        driven(), recording, 16, scale=noise, noise=noise, substeps=2, continued=True
    )
    found, ended = multi_start_fit(search)
    assert ended.begun == "the measured motion"
    assert ended.starts == 1
    assert float(np.sqrt(np.mean((found.rms / noise) ** 2))) < 1.1
    assert found.values()["k"] == pytest.approx(K, rel=0.02)


def test_given_values_that_are_right_stay_the_start():
    recording, noise = recorded()
    compiled = driven()
    true = compiled.vector({"c": C, "k": K, "g": GAIN, "fast": FAST, "slow": SLOW})
    _, ended = multi_start_fit(
        ShortHorizons(
            compiled, recording, 16, start=true, scale=noise, noise=noise, substeps=2,
            continued=True,
        )
    )  # fmt: skip
    assert ended.begun == "the given values"


def test_an_effect_at_the_sensor_of_the_motion_keeps_its_value():
    recording, noise = recorded()
    zero = Placement("offset", library()["offset"].at({"u": "m"}, "offset"), "position_sensor")
    compiled = driven(zero)
    name = f"{zero.prefix}u0"
    begin = compiled.vector({name: 1e-4})
    found = motion_start(compiled, recording, begin, noise, 2)
    values = dict(zip(compiled.system.parameters, found, strict=True))
    assert values[name] == 1e-4
    assert values["g"] != compiled.system.parameters["g"].value


COUPLED = """
parameters.up = { value = 40.0, unit = "N" }
parameters.corner = { value = 1.5, unit = "1/s", fixed = true }
quantities.balance = { expression = "(f + up - c*v - k*x + load)/m", unit = "m/s^2" }
states.mean = { unit = "m/s^2", derivative = "corner*(balance - mean)" }
outputs.acceleration = { unit = "m/s^2", expression = "balance - mean" }
"""


def test_a_constant_force_that_the_accelerometer_does_not_show_is_held_by_the_motion():
    lines = DRIVEN.replace("(f - c*v", "(f + up - c*v").splitlines()
    text = "\n".join([line for line in lines if not line.startswith("outputs.acc")]) + COUPLED
    recording, noise = recorded()
    read, mean = recording.outputs.copy(), 0.0
    for row in read:
        row[1], mean = row[1] - mean, mean + 1.5 * DT * (row[1] - mean)
    coupled = Recording(DT, recording.inputs, read)
    compiled = compile_system(compose(parse(text, Model, "driven")))
    found = motion_start(compiled, coupled, compiled.parameters, noise, 2)
    assert abs(dict(zip(compiled.system.parameters, found, strict=True))["up"]) < 0.5


def test_without_a_measured_motion_there_is_none():
    text = DRIVEN.replace(', measured = "position"', "").replace(', rate_of = "position"', "")
    recording, noise = recorded()
    compiled = compile_system(compose(parse(text, Model, "driven")))
    assert motion_start(compiled, recording, compiled.parameters, noise, 2) is None
