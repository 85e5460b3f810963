"""A simulated mass on a spring with a hidden effect, as an open study in memory."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Accepted, Span, StudyFile
from sim_plant.oscillator import DAMPING, MASS, RATE, STIFFNESS, Hidden, oscillate, strength_for

HORIZON = 256
COMMON = (
    "coulomb", "viscous", "linear_stiffness", "cubic_stiffness",
    "dead_band", "saturation", "gain", "offset", "lag", "delay",
)  # fmt: skip
"""Effects of loads, drives and sensors: enough for a rule that holds in any library."""
IN_ANY_LIBRARY = pytest.mark.parametrize(
    "known",
    [
        pytest.param(COMMON, id="common effects"),
        pytest.param(tuple(library()), id="all effects", marks=pytest.mark.nightly),
    ],
)


def multisine(lines: FloatArray, size: float, seconds: float = 20.0, seed: int = 4) -> FloatArray:
    """Force with these frequencies [Hz] and random phases, rms `size` [N]."""
    time = np.arange(round(seconds * RATE)) / RATE
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    return np.asarray(size * waves / np.sqrt(len(lines) / 2))


def opened(force: FloatArray, hidden: str = "", share: float = 0.05, noise: float = 2e-3) -> Bench:
    """The plant driven by `force`, an effect hidden that changes its outputs by `share`."""
    faults = (Hidden(hidden, strength_for(hidden, force, share)),) if hidden else ()
    return fitted(force, faults, noise)


def fitted(force: FloatArray, hidden: tuple[Hidden, ...], noise: float, seed: int = 1) -> Bench:
    """The same with effects of given strengths; `noise` over the outputs' rms."""
    scale = noise * size_of(force)
    made = [recorded(force, e, scale, seed + k) for k, e in enumerate((hidden, hidden, ()))]
    data = Data(made[0], made[1], made[2], HORIZON, ())
    return bench_of(study(), data, scale)


def recorded(
    force: FloatArray,
    hidden: tuple[Hidden, ...],
    scale: FloatArray,
    seed: int,
    *,
    held: bool = False,
) -> Recording:
    """One recording of the plant; `scale` is the noise's standard deviation of each output."""
    read = oscillate(force, hidden, scale, seed, held=held)
    return Recording(1 / RATE, force[:, None], read)


def size_of(force: FloatArray, *, held: bool = False) -> FloatArray:
    """Standard deviation of each output of the healthy plant under a force."""
    return np.asarray(oscillate(force, (), np.zeros(2), 0, held=held).std(axis=0))


def knowing(study: Study, *names: str) -> Study:
    """The study where the library holds no other effects: the fewer, the sooner they are ranked."""
    return replace(study, effects={name: study.effects[name] for name in names})


def with_few_effects(bench: Bench, *more: str) -> Bench:
    """The bench where the library holds the common effects and these."""
    return replace(bench, study=knowing(bench.study, *more, *COMMON))


def study(effects: tuple[Accepted, ...] = ()) -> Study:
    """A mass-spring-damper that is to be fitted; its recordings are given to it."""
    span = (Span(session="simulated"),)
    start = {"m": 1.2 * MASS, "c": 0.8 * DAMPING, "k": 1.1 * STIFFNESS}
    file = StudyFile(
        model="mass-spring-damper", train=span, held_out=span, start=start, effects=effects
    )
    model = shipped_models()["mass-spring-damper"]
    return Study(Path(), file, model, library(), frozenset())
