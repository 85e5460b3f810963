"""A change of what the model's own parameters stand for is not taken for an effect like it."""

from dataclasses import replace
from pathlib import Path

import pytest

from rigwatch.workbench.compare import shared_bench
from rigwatch.workbench.explain.changed_parameters import (
    _one_comes_near,
    undetermined_if_parameters_changed,
)
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.ranking import no_progress
from tests.workbench.rigs.slides import Hidden, bench
from tests.workbench.simulated import with_few_effects
from tests.workbench.verdicts.test_refinements import MODEL

DRIVEN = (
    MODEL.replace("w*(u - s)", "w*(g*drive - s)")
    + """
[parameters.g]
value = 1.0
unit = "1"
kept = true
[ports.drive]
kind = "actuator"
signal = "u"
"""
)


def test_a_slower_motor_is_no_weaker_one(tmp_path: Path) -> None:
    slower = with_few_effects(bench(tmp_path, Hidden(slower=0.15), DRIVEN))
    rows, verdict = ranking(slower)
    named = replace(verdict, word="missing_effect")
    assert rows[0].label == "gain@drive"

    found = undetermined_if_parameters_changed(slower, named, no_progress)

    assert found.word == "undetermined"
    assert "gain@drive lowers the held-out error" in found.text
    assert "parameters of the model" in found.text


@pytest.mark.parametrize(
    ("hidden", "label", "near"),
    [
        pytest.param(Hidden(slower=0.15), "gain@drive", True, id="a slower motor"),
        pytest.param(Hidden(dry=0.15), "coulomb@load", False, id="friction"),
        pytest.param(Hidden(weaker=0.15), "gain@drive", False, id="its own gain is the effect"),
    ],
)
def test_one_parameter_comes_near_an_effect_that_stands_for_its_change(
    tmp_path: Path, hidden: Hidden, label: str, near: bool
) -> None:
    made = with_few_effects(bench(tmp_path, hidden, DRIVEN))
    named = next(row.fitted for row in ranking(made)[0] if row.label == label)
    assert named is not None
    assert _one_comes_near(made, named) == near


@pytest.mark.parametrize(
    ("hidden", "word"),
    [(Hidden(slower=0.15), "undetermined"), (Hidden(slower=0.15, dry=0.15), "missing_effect")],
    ids=["slower", "slower and rubbing"],
)
def test_two_effects_at_once_are_named_unless_changed_parameters_explain_as_much(
    tmp_path: Path, hidden: Hidden, word: str
) -> None:
    made = with_few_effects(bench(tmp_path, hidden, DRIVEN))
    verdict = ranking(made)[1]
    assert verdict.best is not None
    both = verdict.best.fitted
    second = ("viscous@load",)
    pair = replace(verdict, word="missing_effect", second=second, together=both)

    found = undetermined_if_parameters_changed(made, pair, no_progress)

    assert found.word == word
    assert ("and viscous@load lower the held-out error" in found.text) == (word == "undetermined")


@pytest.mark.parametrize(
    ("weaker", "rubbing", "label"), [(0.05, 0.0, "gain@drive"), (0.0, 0.15, "coulomb@load")]
)
def test_an_effect_that_leaves_nothing_is_named(
    tmp_path: Path, weaker: float, rubbing: float, label: str
) -> None:
    made = bench(tmp_path, Hidden(weaker=weaker, dry=rubbing), DRIVEN)
    rows, verdict = ranking(with_few_effects(made))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == label


@pytest.mark.parametrize(
    ("hidden", "word"),
    [(Hidden(weaker=0.05), "missing_effect"), (Hidden(weaker=0.05, slower=0.01), "undetermined")],
    ids=["weaker", "weaker and a little slower"],
)
def test_beside_shared_parameters_little_that_is_left_is_asked_of_changed_ones(
    tmp_path: Path, hidden: Hidden, word: str
) -> None:
    shared = shared_bench(with_few_effects(bench(tmp_path, hidden, DRIVEN)))
    assert shared is not None
    rows, verdict = ranking(shared)

    assert rows[0].label == "gain@drive"
    assert verdict.word == word, verdict.text
