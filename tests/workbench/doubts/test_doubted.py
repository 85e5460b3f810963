"""An effect that wins alone beside sets of others that leave far less; and what was refused."""

import pytest

from rigwatch.workbench.explain.sets.combination import Combination
from rigwatch.workbench.explain.sets.several_effects import _doubted
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking import Ranked
from tests.workbench.verdicts.test_judge import PERIODS, base, row


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


def test_an_unknown_effect_tells_what_came_nearest_and_why_it_was_refused() -> None:
    refused = row("nearly@load", 2.4, accepted=False)
    refused.reason = "held-out error falls no more than by chance"
    found = judge(base(), [refused, row("worse@load", 2.8, accepted=False)], PERIODS)
    assert found.word == "unknown_effect"
    assert found.text.endswith(
        "; nearest is nearly@load, refused: held-out error falls no more than by chance"
    )
