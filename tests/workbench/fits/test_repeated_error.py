"""Free simulations: an error that repeats with the excitation counts once in the intervals."""

from pathlib import Path

import numpy as np

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.healthy_reference import with_healthy_reference
from rigwatch.workbench.fit.intervals import Value, values
from rigwatch.workbench.ranking.candidates import shapes_of
from rigwatch.workbench.ranking.refitting import refit
from rigwatch.workbench.ranking.scoring import rank_only
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import HORIZON, multisine, recorded, size_of, study

LINES = np.arange(0.25, 8, 0.25)
"""Repeats after 4 s, five times in a recording."""
QUIET = 5e-4
ROUGH = """
name = "line"
summary = "a straight line through a curve"
rough = true
inputs.u = { unit = "V" }
parameters.k = { value = 1.0, unit = "1" }
outputs.y = { unit = "V", expression = "k*u" }
"""


def found(hidden: str, effect: str, port: str) -> tuple[dict[str, Value], dict[str, Value], float]:
    """Parameters with the whole interval and with that of the scatter; the strength hidden."""
    force = multisine(LINES, 4.0, seed=10)
    strength = strength_for(hidden, force, 0.05)
    scale = QUIET * size_of(force)
    made = [
        recorded(force, each, scale, 3 + k)
        for k, each in enumerate(((Hidden(hidden, strength),), (Hidden(hidden, strength),), ()))
    ]
    data = Data(made[0], made[1], made[2], HORIZON, ())
    bench = bench_of(study(), data, scale)
    row = rank_only(bench.study, data, bench.base, shapes_of(bench.study, data.train, effect, port))
    refit(bench.study, data, bench.base, row)
    assert row.fitted is not None
    more = added_variances(bench.study, data, bench.bare, row.fitted)
    return values(row.fitted.train, more), values(row.fitted.train), strength


def holds(value: Value, truth: float) -> bool:
    assert value.interval is not None
    return value.interval[0] <= truth <= value.interval[1]


def test_friction_that_creeps_where_the_machine_sticks() -> None:
    whole, scatter, strength = found("coulomb", "coulomb", "load")
    assert holds(whole["load_coulomb_Fc"], strength)
    assert not holds(scatter["load_coulomb_Fc"], strength)


def test_noise_adds_nothing() -> None:
    whole, scatter, strength = found("cubic_stiffness", "cubic_stiffness", "load")
    assert holds(whole["load_cubic_stiffness_k3"], strength)
    assert whole == scatter


def test_a_healthy_remainder_follows_a_period_that_is_no_whole_number_of_samples() -> None:
    dt, samples, period = 0.01, 1998, 33.3

    def curved(begin: int, noise: int) -> Recording:
        phase = (np.arange(samples) + begin) / period
        u = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
        y = u + 0.3 * u**3 + 1e-3 * np.random.default_rng(noise).normal(size=samples)
        return Recording(dt, u[:, None], y[:, None])

    span = (Span(session="line"),)
    file = StudyFile(model="line", train=span, held_out=span, healthy=span, period=period * dt)
    line = Study(Path(), file, parse(ROUGH, Model, "line"), library(), frozenset())
    data = Data(curved(0, 1), curved(100, 2), curved(40, 3), 3, ())
    made = with_healthy_reference(line, data)[1]
    for recording in (made.train, made.held_out):
        u, unexplained = recording.inputs.T
        slope, wanted = np.linalg.lstsq(u[:, None], 0.3 * u**3, rcond=None)[0][0], 0.3 * u**3
        assert np.std(unexplained - (wanted - slope * u)) < 0.1 * np.std(wanted - slope * u)
