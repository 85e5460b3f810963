"""Free simulations: an error that repeats with the excitation counts once in the intervals."""

import numpy as np

from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.intervals import Value, values
from rigwatch.workbench.ranking.candidates import shapes_of
from rigwatch.workbench.ranking.refitting import refit
from rigwatch.workbench.ranking.scoring import rank_only
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import HORIZON, multisine, recorded, size_of, study

LINES = np.arange(0.25, 8, 0.25)
"""Repeats after 4 s, five times in a recording."""
QUIET = 5e-4


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
