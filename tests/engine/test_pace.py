"""Steps that are as fine as each interval needs give what steps give that are fine everywhere."""

import numpy as np
import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.compile.resolved_rates import FASTEST, resolved
from rigwatch.physics.engine.compile.step_size import (
    FINEST,
    INSTANT,
    constant_rates,
    fastest_of,
    pace,
    steps_for,
)
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit import Recording, fit
from rigwatch.physics.engine.score.compatibility import suits

MODEL = shipped_models()["mass-spring-damper"]
DT, SAMPLES = 1 / 256, 512
SIZES = {"x": 0.1, "v": 1.0, "L": 6.0, "u": 4.0, "rate": 200.0, "dt": DT, "p": 1.0}
STRONG = 2.0
"""Of what an effect is given where its strength has no size of its own."""


def placed():
    """Every effect at the first port that it may stand at, strong enough to be felt."""
    found = []
    for name, effect in library().items():
        port = next((n for n, p in MODEL.ports.items() if suits(effect, p, MODEL)), None)
        if port is None:
            continue
        scaled = effect.scaled(SIZES)
        strength = scaled.parameters[scaled.strength]
        if strength.role == "strength":
            value = float(np.clip(STRONG, strength.low, min(strength.high, STRONG)))
            changed = scaled.parameters | {scaled.strength: replace(strength, value=value)}
            scaled = replace(scaled, parameters=changed)
        found.append(pytest.param(Placement(name, scaled, port), id=f"{name}@{port}"))
    return found


TIME = np.arange(SAMPLES) * DT
SINES = 4 * np.sin(2 * np.pi * 1.3 * TIME) + 3 * np.sin(2 * np.pi * 3.1 * TIME + 1)
RESTS = 4 * np.sign(np.sin(2 * np.pi * 1.1 * TIME)) + 0.5 * np.sin(2 * np.pi * 0.4 * TIME)
"""Friction holds the mass until the force changes its sign."""


def run(system, substeps, finest, force=SINES):
    compiled = compile_system(system)
    return compiled.simulate(
        force[:, None], DT, np.zeros(1, np.int64), SAMPLES,
        initial=np.zeros((1, len(system.states))), parameters=compiled.parameters,
        substeps=substeps, finest=finest,
    )  # fmt: skip


@pytest.mark.parametrize("placement", placed())
def test_every_effect_is_followed_as_by_steps_that_are_fine_everywhere(placement):
    system = compose(MODEL, [placement])
    found, fine = run(system, 2, 256), run(system, 256, 1)
    wrong = np.sqrt(np.mean((found.outputs - fine.outputs) ** 2, axis=(0, 1)))
    # A jump that lies a hair before or after a sample is a sample's worth of difference there.
    assert (wrong <= 0.01 * fine.outputs.std(axis=(0, 1))).all()


def test_friction_needs_fine_steps_about_standstill_and_gets_them():
    friction = Placement("coulomb", library()["coulomb"].scaled(SIZES), "load")
    changed = friction.effect.parameters | {
        "Fc": replace(friction.effect.parameters["Fc"], value=3.0)
    }
    system = compose(MODEL, [replace_effect(friction, changed)])
    fine = run(system, 256, 1).outputs
    coarse, paced = (run(system, 2, finest).outputs for finest in (1, 256))
    assert np.abs(paced - fine)[..., 0].max() < 0.01 * np.abs(coarse - fine)[..., 0].max()


def with_values(name, **values):
    placement = Placement(name, library()[name].scaled(SIZES), "load")
    changed = {n: replace(placement.effect.parameters[n], value=v) for n, v in values.items()}
    return compose(MODEL, [replace_effect(placement, placement.effect.parameters | changed)])


@pytest.mark.parametrize("name", ["dahl", "lugre", "jenkins", "bouc_wen"])
def test_a_contact_stiffer_than_any_step_slips_as_it_does_in_far_finer_steps(name):
    # Its memory would return in a ten-thousandth of a sample.
    system = with_values(name, Fc=2.0, s=3e6)
    # Of the acceleration a sample lies before or after the turn, a hair apart.
    found, fine = (run(system, *steps).outputs[..., 0] for steps in ((2, 256), (4096, 1)))
    assert np.sqrt(np.mean((found - fine) ** 2)) <= 1e-3 * fine.std()


def test_a_contact_at_rest_is_followed_as_by_steps_that_are_fine_everywhere():
    system = with_values("coulomb", Fc=3.0)
    found, fine = (run(system, *steps, RESTS).outputs for steps in ((2, 256), (256, 1)))
    assert (np.abs(found - fine).max(axis=(0, 1)) <= 1e-4 * fine.std(axis=(0, 1))).all()


def test_what_has_decayed_is_zero_and_no_number_too_small_to_be_normal():
    lag = library()["lag"].scaled(SIZES)
    fast = replace(lag.parameters["tau"], value=DT / 4)
    lag = replace(lag, parameters=lag.parameters | {"tau": fast})
    slopes = np.abs(run(compose(MODEL, [Placement("lag", lag, "drive")]), 2, 256).slopes)
    assert slopes[slopes > 0].min() > 1e-250


def test_a_model_alone_and_one_that_is_not_stiff_ask_for_nothing():
    assert pace(compose(MODEL)).asked == ()
    spring = Placement("cubic_stiffness", library()["cubic_stiffness"].scaled(SIZES), "load")
    assert pace(compose(MODEL, [spring])).asked == ()


def test_the_last_states_are_those_of_the_last_sample():
    found = run(compose(MODEL), 4, 1)
    assert found.last[0, 0] == found.outputs[0, -1, 0]


def replace_effect(placement, parameters):
    return Placement(placement.name, replace(placement.effect, parameters=parameters), "load")


INTERVAL = 1 / 200
EDGE = 2.785293563
"""Rate times step at which a Runge-Kutta step of fourth order neither grows nor decays."""


def motor(*placements):
    return compile_system(compose(shipped_models()["motor"], placements))


def discharged(inductance, substeps, *placements):
    """Speed without voltage, from one ampere."""
    compiled = motor(*placements)
    return compiled.simulate(
        np.zeros((40, 1)), INTERVAL, np.zeros(1, np.int64), 40, initial=np.array([[0.0, 1.0]]),
        parameters=compiled.vector({"L": inductance, "J": 1e-3, "K": 0.1, "R": 1.0, "b": 1e-4}),
        substeps=substeps,
    ).outputs[0, :, 0]  # fmt: skip


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_the_current_decays_where_as_many_steps_as_asked_for_would_keep_it(substeps):
    edge = INTERVAL / substeps / EDGE
    assert discharged(edge, substeps) == pytest.approx(
        discharged(edge, 64), abs=1e-3 * discharged(edge, 64).max()
    )


@pytest.mark.parametrize(("name", "port"), [("brush_drop", "winding"), ("supply_sag", "drive")])
def test_an_effect_at_a_fast_mode_leaves_it_as_fast_as_it_is(name, port):
    effect = library()[name].scaled({"i": 1.0, "u": 1.0, "dt": INTERVAL})
    faint = replace(effect.parameters[effect.strength], value=1e-9)
    placement = Placement(
        name, replace(effect, parameters=effect.parameters | {effect.strength: faint}), port
    )
    alone = discharged(INTERVAL / 6, 2)
    assert discharged(INTERVAL / 6, 2, placement) == pytest.approx(alone, abs=1e-3 * alone.max())


def test_a_slow_model_takes_the_steps_asked_for():
    system = motor().system
    names = list(system.parameters)
    at = motor().vector({"L": 0.05, "R": 1.0})
    assert steps_for(fastest_of(system, constant_rates(system), at), INTERVAL) == 1
    at[names.index("L")] = 1e-9
    assert steps_for(fastest_of(system, constant_rates(system), at), INTERVAL) == FINEST


def test_a_mode_that_is_instantaneous_takes_only_the_steps_in_which_it_decays():
    system, rate = motor().system, 5 * INSTANT
    at = motor().vector({"L": INTERVAL / rate, "J": 1e-3, "K": 0.1, "R": 1.0, "b": 1e-4})
    steps = steps_for(fastest_of(system, constant_rates(system), at), INTERVAL)
    assert rate / 2 < steps < rate
    fine = discharged(INTERVAL / rate, 512)
    assert discharged(INTERVAL / rate, 1) == pytest.approx(fine, rel=1e-2)


def test_rates_that_depend_on_the_motion_are_left_to_the_steps_asked_for():
    assert constant_rates(compose(shipped_models()["tanks"])) == ()


MOTOR = shipped_models()["motor"]
COARSE = 1 / 200


def bounds(model=MOTOR, dt=COARSE, **values):
    system = compose(model)
    compiled = compile_system(system)
    return resolved(system, compiled.vector(values), dt).parameters


def test_an_inductance_is_bounded_where_its_time_constant_is_a_sixteenth_of_a_sample():
    assert bounds(R=1.8)["L"].low == pytest.approx(1.8 * COARSE / INSTANT, rel=1e-6)
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
    assert bounds(model)["R"].high == pytest.approx(INSTANT * 5e-3 / COARSE, rel=1e-6)


def test_a_mode_at_the_bound_is_followed_by_stable_steps():
    system = compose(MOTOR)
    compiled = compile_system(system)
    slow = compiled.vector({"L": bounds()["L"].low})
    ends = [
        compiled.simulate(
            np.ones((3, 1)), COARSE, np.zeros(1, np.int64), 3,
            initial=np.array([[0.0, current]]), parameters=slow,
        ).outputs[0, 1, 0]
        for current in (0.0, 1.0)
    ]  # fmt: skip
    # The initial current gives the rotor K·L/R·i at once, and nothing later.
    assert ends[1] - ends[0] == pytest.approx(0.1 * slow[2] / 1.0 / 1e-3, rel=0.05)


def test_a_fit_stops_where_the_recording_no_longer_resolves_a_rate_of_two_free_parameters():
    # The speed alone shows R·J/K² only.
    loose = {"R": replace(MOTOR.parameters["R"], fixed=False, low=0.1)}
    known = {"J": replace(MOTOR.parameters["J"], fixed=True)}
    changed = replace(MOTOR, parameters=MOTOR.parameters | loose | known)
    compiled = compile_system(compose(changed))
    voltage = np.sign(np.sin(np.arange(600) * COARSE * 9.0))[:, None] * 6.0
    truth = {"L": 5e-5, "R": 1.6, "K": 0.1, "J": 1e-3, "b": 1e-4}
    speed = compiled.simulate(
        voltage, COARSE, np.zeros(1, np.int64), 600,
        initial=np.zeros((1, 2)), parameters=compiled.vector(truth),
    ).outputs[0]  # fmt: skip
    noise = 0.05 * np.random.default_rng(3).standard_normal(speed.shape)
    recording = Recording(COARSE, voltage, speed + noise)
    found = fit(compiled, recording, 100, start=compiled.vector({"L": 5e-3, "R": 1.0}))
    assert found.values()["R"] / found.values()["L"] * COARSE <= FASTEST * 1.001
    assert found.values()["R"] == pytest.approx(1.6, rel=1e-3)
    assert found.rms[0] < 1.1 * 0.05
