"""Directions of missing effects are right to first order; the hidden one ranks first."""

import numpy as np
import pytest

from rigwatch.physics.engine.compiled import compile_system
from rigwatch.physics.engine.directions import Candidate, directions, shaped, trajectory
from rigwatch.physics.engine.effect import library
from rigwatch.physics.engine.fit import Recording, fit, windows
from rigwatch.physics.engine.model import shipped_models
from rigwatch.physics.engine.score import Projector, score
from rigwatch.physics.engine.system import Placement, compose

MODEL = shipped_models()["mass-spring-damper"]
DT = 1 / 256
SAMPLES = 1280
TRUE = {"m": 0.8, "c": 1.5, "k": 60.0}
GENTLE = {"vs": 0.05, "s": 50.0}


def excitation(seed=1):
    rng = np.random.default_rng(seed)
    time, band = np.arange(SAMPLES) * DT, np.arange(0.5, 8, 0.5)
    waves = np.cos(2 * np.pi * np.outer(time, band) + rng.uniform(0, 2 * np.pi, len(band)))
    return 4.0 * waves.sum(axis=1, keepdims=True)


def placed():
    return [
        (name, port)
        for name, effect in library().items()
        for port, place in MODEL.ports.items()
        if effect.fits(place.kind)
    ]


@pytest.mark.parametrize(("name", "port"), placed(), ids=lambda value: value)
def test_a_direction_is_the_derivative_of_the_composed_model(name, port):
    effect, u = library()[name], excitation()
    whole = compile_system(compose(MODEL, [Placement(name, effect, port)]))
    prefix = f"{port}_{name}_"
    shape = {key: GENTLE[key] for key in effect.parameters if key in GENTLE}
    strength = effect.parameters[effect.strength].neutral
    values = {prefix + key: value for key, value in shape.items()}
    base = whole.vector({**TRUE, **values, prefix + effect.strength: strength})
    starts, first = np.array([0]), np.zeros((1, len(whole.system.states)))
    run = whole.simulate(u, DT, starts, SAMPLES, initial=first, parameters=base)
    expected = run.slopes[..., whole.system.free.index(prefix + effect.strength)]
    bare = compile_system(compose(MODEL))
    at = trajectory(
        bare, u, DT, starts, SAMPLES, initial=np.zeros((1, 2)), parameters=bare.vector(TRUE)
    )
    found = directions(at, [Candidate(name, effect, port, shape)])[..., 0]
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


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
        for c in shaped(name, library()[name], port)
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
