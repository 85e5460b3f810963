"""Inputs that are held between samples and arrive late, and recordings at rates of their own."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import CompiledSystem, compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.physics.engine.score.trajectory import trajectory
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.fit.input_hold.hold_trials import with_holds

MASS = """
name = "mass"
summary = "A mass on a damper."
inputs.force = { unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(drive - c*v + load)/m", rate_of = "position" }
parameters.m = { value = 1.0, unit = "kg", low = 1e-3 }
parameters.c = { value = 1.0, unit = "N s/m", low = 0.0 }
outputs.position = { unit = "m", expression = "x" }
ports.drive = { kind = "actuator", signal = "force" }
ports.load = { kind = "force", unit = "N", variables.v = { expression = "v", unit = "m/s" } }
"""
DT = 0.01
MODEL = parse(MASS, Model, "mass.toml")
VALUES = {"m": 0.8, "c": 1.5}
TAU = "drive_delay_tau"


def placed(*names: str) -> list[Placement]:
    sizes = {"dt": DT, "u": 1.0, "rate": 10.0}
    return [Placement(name, library()[name].scaled(sizes), "drive") for name in names]


def late_mass(model: Model = MODEL, late: float = 0.0, beside: tuple[str, ...] = ()):
    held = with_holds(model, {"force": ("zero", late)})
    return compile_system(compose(held, placed("delay", *beside)))


def moved(system: CompiledSystem, force: np.ndarray, tau: float, dt=DT, **options):
    known = {"initial": np.zeros((1, 2)), "substeps": 8} | options
    return system.simulate(
        force[:, None], dt, np.zeros(1, np.int64), len(force),
        parameters=system.vector(VALUES | {TAU: tau}), **known,
    )  # fmt: skip


def answer(force: np.ndarray, tau: float) -> np.ndarray:
    """Position in closed form: the sum of the answers to all steps, each late by tau."""
    steps, rate = np.diff(force, prepend=0.0), VALUES["c"] / VALUES["m"]
    begun = np.arange(len(force)) * DT + tau
    since = np.maximum(np.arange(len(force))[:, None] * DT - begun, 0.0)
    return ((since - (1 - np.exp(-rate * since)) / rate) / VALUES["c"]) @ steps


@pytest.mark.parametrize("share", [0.02, 0.4, 1.0, 2.0, 3.7])
@pytest.mark.parametrize("late", [0.0, 0.25])
def test_a_held_input_is_delayed_exactly_and_so_are_its_sensitivities(share, late):
    force = np.random.default_rng(1).normal(size=40)
    force[:5] = 0.0
    system, tau = late_mass(late=late), share * DT
    assert len(system.system.states) == 2
    run = moved(system, force, tau)
    np.testing.assert_allclose(run.outputs[0, :, 0], answer(force, tau + late * DT), atol=1e-12)
    tiny = 1e-6
    ends = [moved(system, force, tau + way * tiny).outputs[0, :, 0] for way in (-1, 1)]
    slopes = run.slopes[0, :, 0, list(system.system.free).index(TAU)]
    # Where the difference spans a sample it is off by its own size.
    np.testing.assert_allclose(slopes, (ends[1] - ends[0]) / (2 * tiny), atol=3e-6)
    assert np.abs(slopes).max() > 0.01


def test_before_a_recording_begins_a_late_input_has_its_first_value():
    force = np.concatenate([np.full(20, 3.0), np.full(20, 1.0)])
    begins = np.repeat([0, 20], 20)
    system = late_mass()
    run = system.simulate(
        force[:, None], DT, np.array([20]), 20, initial=np.zeros((1, 2)), begins=begins,
        parameters=system.vector(VALUES | {TAU: 2.5 * DT}),
    )  # fmt: skip
    alone = moved(system, np.full(20, 1.0), 0.0, substeps=4)
    np.testing.assert_allclose(run.outputs[0], alone.outputs[0], atol=1e-12)


def test_a_delay_beside_memory_or_read_at_once_keeps_its_states():
    assert len(late_mass(beside=("lag",)).system.states) == 6
    assert len(late_mass(beside=("saturation",)).system.states) == 2
    soft = 'parameters.e = { value = 1e-3, unit = "m/N", fixed = true }'
    direct = soft + MASS.replace('m", expression = "x"', 'm", expression = "x + e*drive"')
    assert len(late_mass(parse(direct, Model, "mass.toml")).system.states) == 5


def test_a_fit_finds_the_delay_where_an_approximant_rings():
    rng = np.random.default_rng(2)
    force = np.repeat(rng.normal(size=60), 10)
    position = answer(force, 1.6 * DT) + 1e-5 * rng.normal(size=len(force))
    recording = Recording(DT, force[:, None], position[:, None])
    system = late_mass()
    start = system.vector({"m": 1.0, "c": 1.0, TAU: 0.7 * DT})
    found = fit(system, recording, 100, start=start)
    assert found.values()[TAU] == pytest.approx(1.6 * DT, rel=2e-3)
    assert found.rms == pytest.approx(1e-5, rel=0.1)


def test_a_run_at_the_nodes_sees_the_input_as_late_as_the_samples_do():
    force, system = np.random.default_rng(3).normal(size=12), late_mass()
    at = trajectory(
        system, force[:, None], DT, np.zeros(1, np.int64), 12, initial=np.zeros((1, 2)),
        parameters=system.vector(VALUES | {TAU: 1.5 * DT}), substeps=4,
    )  # fmt: skip
    now, late = at.inputs[0].T
    np.testing.assert_array_equal(now[::4], force)
    np.testing.assert_array_equal(late[::4][2:], force[:-2])
    np.testing.assert_array_equal(late[2::4][1:], force[:-2])
    whole = moved(system, force, 1.5 * DT)
    np.testing.assert_allclose(at.run.outputs[0], whole.outputs[0], atol=1e-9)


def test_recordings_at_their_own_rates_move_as_each_alone():
    held = compile_system(compose(with_holds(MODEL, {"force": ("zero", 0.0)}), ()))
    force = np.random.default_rng(4).normal(size=(2, 50))
    parts = [
        Recording(dt, own[:, None], np.zeros((50, 1)))
        for dt, own in zip((0.01, 0.0104), force, strict=True)
    ]
    both = joined(parts)
    parameters = held.vector(VALUES)

    def simulated(recording, starts):
        return held.simulate(
            recording.inputs, recording.spacing, starts, 25, parameters=parameters,
            initial=np.zeros((len(starts), 2)),
        ).outputs  # fmt: skip

    together = simulated(both, np.array([0, 25, 50, 75]))
    alone = [simulated(part, np.array([0, 25])) for part in parts]
    np.testing.assert_array_equal(together, np.concatenate(alone))
    same = simulated(replace(both, spacings=()), np.array([0, 25, 50, 75]))
    assert not np.allclose(same, together, rtol=1e-3)
