"""Directions of missing effects are right to first order; the hidden one ranks first."""

import numpy as np
import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording, windows
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.physics.engine.score.candidates import Candidate, root_mean_square, shaped
from rigwatch.physics.engine.score.compatibility import possible, suits
from rigwatch.physics.engine.score.effect_sensitivities import directions
from rigwatch.physics.engine.score.score_test import Projector, score
from rigwatch.physics.engine.score.trajectory import trajectory

MODEL = shipped_models()["mass-spring-damper"]
DT = 1 / 256
SAMPLES = 1280
TRUE = {"m": 0.8, "c": 1.5, "k": 60.0}
SIZES = {"x": 0.03, "v": 0.5, "L": 6.0, "u": 0.01, "rate": 1.0, "dt": DT, "p": 1.0}
GENTLE = {"vs": 0.05, "td": 0.001}


def excitation(seed=1):
    rng = np.random.default_rng(seed)
    time, band = np.arange(SAMPLES) * DT, np.arange(0.5, 8, 0.5)
    waves = np.cos(2 * np.pi * np.outer(time, band) + rng.uniform(0, 2 * np.pi, len(band)))
    return 4.0 * waves.sum(axis=1, keepdims=True)


def ready(name):
    """The effect for signals of the test's size; a switch as a strength that can be varied."""
    effect = library()[name].scaled(SIZES)
    changed = {
        n: replace(effect.parameters[n], value=GENTLE[n]) for n in GENTLE if n in effect.parameters
    }
    for n, p in effect.parameters.items():
        if p.role == "switch":
            changed[n] = replace(p, role="strength", value=0.0)
    return replace(effect, parameters=effect.parameters | changed)


def placed():
    return [
        (name, port)
        for name, effect in library().items()
        for port, place in MODEL.ports.items()
        if suits(effect, place, MODEL)
    ]


def exact():
    """Effects whose derivative at their neutral strength the composed model has, too."""
    return [(name, port) for name, port in placed() if not library()[name].direction]


@pytest.mark.parametrize(("name", "port"), exact(), ids=lambda value: value)
def test_a_direction_is_the_derivative_of_the_composed_model(name, port):
    effect, u = ready(name), excitation()[:120]
    whole = compile_system(compose(MODEL, [Placement(name, effect, port)]))
    prefix = f"{port}_{name}_"
    strength = effect.parameters[effect.strength].neutral
    base = whole.vector({**TRUE, prefix + effect.strength: strength})
    starts, first = np.array([0]), np.zeros((1, len(whole.system.states)))
    run = whole.simulate(u, DT, starts, len(u), initial=first, parameters=base)
    expected = run.slopes[..., whole.system.free.index(prefix + effect.strength)]
    bare = compile_system(compose(MODEL))
    at = trajectory(
        bare, u, DT, starts, len(u), initial=np.zeros((1, 2)), parameters=bare.vector(TRUE)
    )
    shape = {n: p.value for n, p in effect.parameters.items() if n != effect.strength}
    found = directions(at, [Candidate(name, effect, port, shape)])[..., 0]
    # Before the composed model's substeps and ours agree, a kink may lie between them.
    wrong = np.sqrt(np.mean((found - expected) ** 2))
    assert wrong <= 2e-2 * np.sqrt(np.mean(expected**2))


@pytest.mark.parametrize("name", ["constant_force", "cubic_stiffness", "viscous"])
def test_a_direction_does_not_grow_where_a_decay_is_faster_than_the_steps(name):
    effect, u = ready(name), excitation()[:120]
    steps = 4 / DT
    drag = 2.5 * TRUE["m"] * steps
    whole = compile_system(compose(MODEL, [Placement(name, effect, "load")]))
    strength = f"load_{name}_{effect.strength}"
    starts, known = np.array([0]), {**TRUE, "c": drag}
    run = whole.simulate(
        u, DT, starts, len(u), initial=np.array([[0.03, 0.0]]),
        parameters=whole.vector({**known, strength: 0.0}), substeps=16,
    )  # fmt: skip
    expected = run.slopes[..., whole.system.free.index(strength)]
    bare = compile_system(compose(MODEL))
    at = trajectory(
        bare, u, DT, starts, len(u), initial=np.array([[0.03, 0.0]]),
        parameters=bare.vector(known), substeps=4,
    )  # fmt: skip
    found = directions(at, [Candidate(name, effect, "load", {})])[..., 0]
    moved = [list(MODEL.outputs).index("position")]
    wrong = np.sqrt(np.mean((found - expected)[..., moved] ** 2))
    assert wrong <= 2e-2 * np.sqrt(np.mean(expected[..., moved] ** 2))


@pytest.mark.parametrize("name", ["coulomb", "jenkins", "gain"])
def test_a_contact_that_is_faster_than_samples_asks_for_no_nodes_between_them(name):
    model = shipped_models()["emps-force"]
    effect, contact = ready(name), ready("dahl")
    port = "force_sensor" if name == "gain" else "load"
    time = np.arange(400) * DT
    given = np.stack(
        [np.sin(7.0 * time), 7.0 * np.cos(7.0 * time), -49.0 * np.sin(7.0 * time)], axis=1
    )
    there = Placement("dahl", contact, "load")
    whole = compile_system(compose(model, [there, Placement(name, effect, port)]))
    bare = compile_system(compose(model, [there]))
    known = {"load_dahl_Fc": 2.0, "load_dahl_s": 3000.0}
    strength = f"{port}_{name}_{effect.strength}"
    starts, neutral = np.array([0]), effect.parameters[effect.strength].neutral
    run = whole.simulate(
        given, DT, starts, len(given), initial=np.zeros((1, len(whole.system.states))),
        parameters=whole.vector({**known, strength: neutral}),
    )  # fmt: skip
    expected = run.slopes[..., whole.system.free.index(strength)]
    at = trajectory(
        bare, given, DT, starts, len(given), initial=np.zeros((1, len(bare.system.states))),
        parameters=bare.vector(known), substeps=32,
    )  # fmt: skip
    assert at.time.shape == (1, len(given))
    shape = {n: p.value for n, p in effect.parameters.items() if n != effect.strength}
    found = directions(at, [Candidate(name, effect, port, shape)])[..., 0]
    assert root_mean_square(found - expected) <= 2e-2 * root_mean_square(expected)


@pytest.mark.parametrize("name", ["coulomb_running_in", "jenkins"])
def test_what_an_effect_remembers_is_of_its_own_recording(name):
    effect, u = ready(name), excitation()[:768]
    shape = {n: p.value for n, p in effect.parameters.items() if n != effect.strength}
    bare, length, windows_of_each = compile_system(compose(MODEL)), 128, 3
    begins = np.repeat([0, 384], 384)
    first = np.random.default_rng(3).normal(size=(2 * windows_of_each, 2)) * (0.03, 0.5)

    def moved(signal, initial, began):
        starts = np.arange(0, len(signal), length)
        values = bare.vector(TRUE)
        at = trajectory(
            bare, signal, DT, starts, length, initial=initial, parameters=values, begins=began
        )
        return directions(at, [Candidate(name, effect, "load", shape)])[..., 0]

    together = moved(u, first, begins)
    second = moved(u[384:], first[windows_of_each:], np.zeros(384, np.int64))
    assert np.allclose(together[windows_of_each:], second, rtol=1e-9, atol=1e-15)


@pytest.mark.kernels
def test_the_hidden_effect_ranks_first():
    friction = Placement("coulomb", library()["coulomb"], "load")
    plant, u = compile_system(compose(MODEL, [friction])), excitation()
    truth = plant.vector({**TRUE, "load_coulomb_Fc": 0.2})
    clean = plant.simulate(
        u, DT, np.array([0]), SAMPLES, initial=np.zeros((1, 2)), parameters=truth
    ).outputs[0]
    noise = 0.003 * clean.std(axis=0)
    measured = clean + noise * np.random.default_rng(5).normal(size=clean.shape)
    base = compile_system(compose(MODEL))
    found = fit(base, Recording(DT, u, measured), 256, scale=noise)
    candidates = [
        c
        for name, port in placed()
        if not library()[name].states
        for c in shaped(name, ready(name), port)
    ]
    scores = ranked(base, u, found, candidates, noise)
    assert candidates[int(np.argmax(scores.score))].name == "coulomb"
    assert scores.corrected.min() < 1e-6
    assert scores.strength[np.argmax(scores.score)] == pytest.approx(0.2, rel=0.1)


def ranked(base, u, found, candidates, noise):
    cut = windows(base.system, SAMPLES, 256)
    at = trajectory(
        base, u, DT, cut.starts, cut.length, initial=found.initial, parameters=found.parameters
    )
    run = base.simulate(
        u, DT, cut.starts, cut.length, initial=found.initial, parameters=found.parameters
    )
    flat = (len(cut.starts), -1)
    slopes = (run.slopes / noise[:, None]).reshape(*flat, run.slopes.shape[-1])
    moved = directions(at, candidates)
    fitted = Projector(slopes[..., :3], slopes[..., 3:])
    scaled = (moved / noise[:, None]).reshape(*flat, len(candidates))
    return score((found.residuals / noise).reshape(flat), scaled, fitted, variance=1.0)


def test_a_signal_without_samples_has_no_size_and_gives_no_warning(recwarn):
    assert root_mean_square(np.full(5, np.nan)) == 1.0
    assert root_mean_square(np.array([3.0, np.nan, -3.0])) == 3.0
    assert not recwarn.list


@pytest.mark.parametrize(
    ("times", "may_be"), [(0.5, True), (4.0, True), (20.0, False), (-0.5, False)]
)
def test_an_estimated_strength_may_be_several_times_its_bound_with_its_sign(times, may_be):
    (late,) = shaped("delay", library()["delay"].scaled({"dt": DT, "u": 1.0}), "position_sensor")

    assert possible(late, times * late.effect.parameters["tau"].high) is may_be
