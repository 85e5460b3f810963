"""An effect of the wrong shape is not named with confidence where any other law fits far better."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.credibility import OTHER_SHAPE, undetermined_if_another_law
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking import best_free_law, rank_all, refit
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import fitted, multisine

FORCE = multisine(np.arange(0.25, 8.0, 0.25), 4.0)


@pytest.fixture(scope="module")
def stiffening() -> Bench:
    """A spring that stiffens, and a little of something that no law at the load explains."""
    shares = {"cubic_stiffness": 0.1, "acceleration_lag": 0.005}
    hidden = tuple(Hidden(name, strength_for(name, FORCE, s)) for name, s in shares.items())
    return fitted(FORCE, hidden, 2e-3)


def named(bench: Bench, label: str):
    """The verdict where this effect alone is fitted."""
    row = next(row for row in rank_all(bench.study, bench.data, bench.base) if row.label == label)
    refit(bench.study, bench.data, bench.base, row)
    return judge(bench.base, [row], bench.floor)


def left(bench: Bench, fitted) -> float:
    return bench.floor.left_over(bench.base.held_out, fitted.held_out)


def test_a_free_law_finds_the_variable_and_leaves_what_the_right_effect_leaves(stiffening):
    law = best_free_law(stiffening.study, stiffening.data, stiffening.base, "load")
    assert law is not None
    assert law.variable == "x"
    right = named(stiffening, "cubic_stiffness@load").best
    assert left(stiffening, law.fitted) == pytest.approx(left(stiffening, right.fitted), rel=0.25)


def test_an_effect_of_another_shape_is_undetermined_and_the_right_one_is_not(stiffening):
    wrong = replace(named(stiffening, "hard_stop@load"), word="missing_effect")
    found = undetermined_if_another_law(stiffening, wrong)
    assert found.word == "undetermined"
    assert found.best is wrong.best
    assert "hard_stop@load lowers the held-out error most" in found.text
    assert "a free function of x at load" in found.text
    right = replace(named(stiffening, "cubic_stiffness@load"), word="missing_effect")
    assert undetermined_if_another_law(stiffening, right) is right


def test_only_a_single_effect_named_above_the_noise_is_compared(stiffening):
    wrong = replace(named(stiffening, "hard_stop@load"), word="missing_effect")
    for other in (
        replace(wrong, word="undetermined"),
        replace(wrong, beside=("lag@acceleration_sensor",)),
        replace(wrong, best=None),
    ):
        assert undetermined_if_another_law(stiffening, other) is other
    low = replace(stiffening, floor=replace(stiffening.floor, rms=stiffening.floor.rms * 100))
    assert undetermined_if_another_law(low, wrong) is wrong


def test_a_law_that_is_little_better_is_no_reason_to_doubt(stiffening, monkeypatch):
    wrong = replace(named(stiffening, "hard_stop@load"), word="missing_effect")
    law = best_free_law(stiffening.study, stiffening.data, stiffening.base, "load")
    share = stiffening.floor.left_over(wrong.best.fitted.held_out, law.fitted.held_out)
    assert share < OTHER_SHAPE
    monkeypatch.setattr("rigwatch.workbench.explain.credibility.OTHER_SHAPE", 0.9 * share)
    assert undetermined_if_another_law(stiffening, wrong) is wrong
