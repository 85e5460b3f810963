"""Samples beside a jump of friction are known, and do not count against it."""

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit.discontinuities import MOST, away_from_jumps
from tests.workbench.simulated import HORIZON, multisine, opened

pytestmark = pytest.mark.long

FORCE = multisine(np.arange(0.25, 8.0, 0.25), 1.0)


def fitted(bench, name):
    effect = library()[name].scaled({"x": 0.1, "v": 0.5, "L": 1.0})
    compiled = compile_system(compose(bench.study.model, [Placement(name, effect, "load")]))
    return fit(compiled, bench.data.train, HORIZON, scale=bench.base.train.scale)


@pytest.fixture(scope="module")
def bench():
    return opened(FORCE, "coulomb")


def test_friction_jumps_where_the_motion_turns_round(bench):
    calm = away_from_jumps(fitted(bench, "coulomb"), bench.data.train, HORIZON)
    assert calm is not None
    position = bench.data.train.outputs[: calm.size, 0]
    turning = np.abs(np.gradient(position)) < 0.01 * np.abs(np.gradient(position)).max()
    assert 0 < 1 - calm.mean() < MOST
    assert (~calm.ravel())[turning].mean() > 10 * (~calm.ravel())[~turning].mean()


@pytest.mark.parametrize("name", ["viscous", "cubic_stiffness", "dahl"])
def test_what_goes_smoothly_has_no_jumps(bench, name):
    assert away_from_jumps(fitted(bench, name), bench.data.train, HORIZON) is None


def test_the_floor_counts_the_samples_that_it_is_given(bench):
    held_out, floor = bench.base.held_out, bench.floor
    every = np.ones(held_out.residuals.shape[:2], bool)
    assert floor.ratio(held_out, every) == pytest.approx(floor.ratio(held_out))
    loudest = np.abs(held_out.residuals[..., 1]) < np.quantile(
        np.abs(held_out.residuals[..., 1]), 0.9
    )
    assert floor.ratio(held_out, loudest) < floor.ratio(held_out)


@pytest.mark.nightly
def test_strong_stick_slip_is_named_though_it_leaves_jumps():
    bench = opened(FORCE, "stribeck", 0.1)
    rows, verdict = ranking(bench)
    assert verdict.word == "missing_effect"
    assert rows[0].label == "stribeck@load"
