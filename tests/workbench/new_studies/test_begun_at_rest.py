"""A motor that steps from rest: its friction is scored as what it is, not as the model creeps."""

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording, joined
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking.at_rest import begun_at_rest
from rigwatch.workbench.ranking.scoring import rank_all
from tests.workbench.motors import motor_study
from tests.workbench.simulated import knowing
from tests.workbench.test_hidden_current import K, R, turned

REST, TURNS, COUNT = 15, 65, 0.5
"""Rows at rest and after a step of the voltage; steps of the encoder's speed [rad/s]."""


def stepped(volts: float, seed: int) -> Recording:
    """Speed of a motor with dry friction after a step from rest, in whole counts."""
    made = turned(np.repeat([0.0, volts], [REST, TURNS]), seed)
    speed = np.round(made.outputs / COUNT) * COUNT
    speed[:REST] = 0.0
    return Recording(made.dt, made.inputs, speed)


@pytest.fixture(scope="module")
def started() -> Bench:
    train = joined([stepped(volts, seed) for seed, volts in enumerate((3.0, 7.0))])
    known = ("coulomb", "dead_band", "brush_drop", "viscous", "constant_force")
    study = knowing(motor_study(R, K), *known)
    return bench_of(study, Data(train, stepped(1.0, 5), None, 40, ()))


def test_dry_friction_of_a_motor_that_starts_is_like_the_residual(started: Bench) -> None:
    rows = {row.label: row for row in rank_all(started.study, started.data, started.base)}
    friction, drop = rows["coulomb@shaft"], rows["brush_drop@winding"]
    assert friction.p_value < 1e-3
    assert friction.cosines["brush_drop@winding"] > 0.95
    assert friction.explained > 0.9 * drop.explained


def test_only_a_window_that_begins_at_rest_begins_at_the_models_rest(started: Bench) -> None:
    base, initial = started.base, np.array([[0.3, -2.0], [20.0, 1.0]])
    found = begun_at_rest(
        base.compiled, started.data.train, np.array([0, REST + 1]),
        initial=initial, parameters=base.train.parameters, substeps=4,
    )  # fmt: skip
    np.testing.assert_allclose(found[0], 0.0, atol=1e-6)
    np.testing.assert_array_equal(found[1], initial[1])
