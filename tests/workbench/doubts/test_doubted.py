"""An effect that wins alone beside sets of others that leave far less; and what was refused."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.sets.as_simple import by_set_as_simple
from rigwatch.workbench.explain.sets.combination import Combination
from rigwatch.workbench.explain.sets.several_effects import _doubted, _with_best_set
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking import Ranked
from tests.workbench.dampers import stroke
from tests.workbench.machine import studied
from tests.workbench.simulated import knowing
from tests.workbench.studies.test_recordings_apart import DAMPER, UNITS
from tests.workbench.verdicts.test_judge import PERIODS, QUIET, base, row


def sets_with(pair_error: float, *pair: str) -> tuple[list[Ranked], list[Combination]]:
    """Three effects, of which the first wins alone, and a pair that leaves this error."""
    alone = [row("alone@load", 2.0), row("one@load", 2.6), row("other@drive", 2.7)]
    last = row(pair[-1], pair_error)
    first = next(each for each in alone if each.label == pair[0])
    return alone, [*(Combination((each,)) for each in alone), Combination((first, last))]


@pytest.mark.parametrize(
    ("pair_error", "pair", "word"),
    [
        (1.2, ("one@load", "other@drive"), "undetermined"),
        (1.8, ("one@load", "other@drive"), "missing_effect"),
        (1.2, ("alone@load", "other@drive"), "missing_effect"),
    ],
)
def test_a_set_without_it_that_leaves_far_less_puts_it_in_doubt(
    pair_error: float, pair: tuple[str, str], word: str
) -> None:
    alone, every = sets_with(pair_error, *pair)
    verdict = judge(base(10.0), alone, PERIODS)
    assert verdict.word == "missing_effect"
    found = _doubted(verdict, every)
    assert found.word == word
    assert found.best is verdict.best
    if word == "undetermined":
        assert set(found.rivals) >= set(pair)
        assert "one@load, other@drive together explain more than alone@load" in found.text


def bent(pair_error: float, own_error: float, plain: str = "dry") -> tuple[list[Ranked], Any]:
    """A law with a shape wins alone; a plain one with another and it with another are sets."""
    alone = [row("bent@load", 2.0, free=2, family="dry"), row("plain@load", 2.3, family=plain)]
    pair = Combination((alone[1], row("other@load", pair_error)))
    own = Combination((alone[0], row("other@load", own_error)))
    return alone, [*(Combination((each,)) for each in alone), pair, own]


@pytest.mark.parametrize(
    ("pair_error", "own_error", "family", "word", "named"),
    [
        (1.8, 1.7, "dry", "missing_effect", "plain@load"),
        (1.8, 1.7, "wet", "undetermined", "bent@load"),
        (1.97, 1.9, "dry", "missing_effect", "bent@load"),
        (1.8, 1.1, "dry", "missing_effect", "bent@load"),
    ],
)
def test_of_one_physics_the_plain_law_is_named_if_a_set_with_it_is_as_simple_and_leaves_less(
    pair_error: float, own_error: float, family: str, word: str, named: str
) -> None:
    alone, every = bent(pair_error, own_error, family)
    bench: Any = SimpleNamespace(base=base(10.0), floor=PERIODS)
    verdict = judge(bench.base, alone, PERIODS)
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "bent@load")
    found = by_set_as_simple(bench, alone, verdict, every) or verdict
    assert (found.word, found.members[0]) == (word, named)
    told = "other@load, plain@load together, with no more parameters, leave 1.8 N" in found.text
    assert told == (found is not verdict)


@pytest.mark.parametrize(
    ("pair_errors", "own_error", "start", "word", "told"),
    [
        ((1.5, 2.1), 1.7, 5.0, "undetermined", "but other@load, plain@load together, with"),
        ((2.2, 1.5), 1.7, 5.0, "undetermined", "but other@load, plain@load together, with"),
        ((2.2, 2.1), 1.7, 5.0, "missing_effect", "leave 2.1 N, and what else is missing may"),
        ((1.5, 3.2), 1.7, 5.0, "missing_effect", ""),  # far too much of what is held out
        ((1.5, 2.1), 1.7, 20.0, "missing_effect", ""),  # it leaves next to nothing
        ((1.5, 2.1), 1.3, 5.0, "missing_effect", ""),  # it only needs company
    ],
)
def test_a_set_as_simple_that_leads_on_all_recordings_or_is_near_is_told_where_much_is_left(
    pair_errors: tuple[float, float], own_error: float, start: float, word: str, told: str
) -> None:
    alone, every = bent(pair_errors[1], own_error)
    pair = every[2].rows[-1]
    pair.fitted = replace(pair.fitted, train=base(pair_errors[0]).train)
    bench: Any = SimpleNamespace(base=base(start), floor=QUIET)
    found = _with_best_set(bench, alone, judge(bench.base, alone, QUIET), every[2], every)
    assert (found.word, found.members[0]) == (word, "bent@load")
    assert told in found.text
    assert ("no more parameters" in found.text) == bool(told)
    assert {"other@load", "plain@load"} <= set(found.rivals) or word == "missing_effect"


def test_dry_friction_and_drag_are_not_called_falling_friction_where_more_is_missing(
    tmp_path: Path,
) -> None:
    def force(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        unknown = 0.1 * np.sin(x / 2.3e-3) * np.cos(v / 0.021)
        return np.asarray(np.tanh(v / 1e-3) + 110 * v * abs(v) + unknown)

    train, held_out = ([stroke(seed, force, 0.02)] for seed in (0, 1))
    study = studied(tmp_path / "made", DAMPER, train, held_out, UNITS)
    few = knowing(study, "coulomb", "stribeck", "quadratic_drag", "linear_stiffness", "gain")
    found, verdict = ranking(open_bench(few))
    falling = next(each for each in found if each.label == "stribeck@load")
    plain = next(each for each in found if each.label == "coulomb@load")
    assert falling.held_out_error < plain.held_out_error / 1.5
    assert (verdict.word, verdict.members) == ("missing_effect", ("coulomb@load",))
    assert "coulomb@load, quadratic_drag@load together, with no more parameters" in verdict.text


def test_an_unknown_effect_tells_what_came_nearest_and_why_it_was_refused() -> None:
    refused = row("nearly@load", 2.4, accepted=False)
    refused.reason = "held-out error falls no more than by chance"
    found = judge(base(), [refused, row("worse@load", 2.8, accepted=False)], PERIODS)
    assert found.word == "unknown_effect"
    assert found.text.endswith(
        "; nearest is nearly@load, refused: held-out error falls no more than by chance"
    )
