"""The probability of being wrong: counts of simulated verdicts, by cell."""

import pytest

from rigwatch.workbench.explain.verdict_calibration import (
    Evidence,
    cases_seen,
    cases_seen_along,
    cell_of,
    probability_wrong,
    probability_wrong_along,
)


def test_a_clear_verdict_is_doubted_less_than_one_that_leaves_much() -> None:
    clear, vague = Evidence(left=0.0, margin=99.0), Evidence(left=0.5, margin=0.0)
    assert (
        probability_wrong("missing_effect", clear)
        < 0.01
        < probability_wrong("missing_effect", vague)
    )


def test_where_no_case_was_simulated_nothing_is_promised() -> None:
    nowhere = Evidence(left=0.5, margin=99.0)
    assert cases_seen("nothing_missing", nowhere) == (0, 0)
    assert probability_wrong("nothing_missing", nowhere) == pytest.approx(0.5)


def test_cells_part_at_their_edges() -> None:
    assert cell_of("missing_effect", Evidence(0.02, 3.0)) == ("missing_effect", 0, 0)
    assert cell_of("missing_effect", Evidence(0.021, 3.1)) == ("missing_effect", 1, 1)
    assert cell_of("missing_effect", Evidence(0.11, 6.1)) == ("missing_effect", 2, 2)


@pytest.mark.parametrize("rough", [False, True])
@pytest.mark.parametrize("word", ["missing_effect", "nothing_missing", "undetermined"])
def test_a_verdict_along_the_motion_is_doubted_by_its_own_word(word: str, rough: bool) -> None:
    cases, wrong = cases_seen_along(word, rough=rough)
    assert 0 <= wrong < cases
    assert probability_wrong_along(word, rough=rough) == pytest.approx((wrong + 1) / (cases + 2))


def test_along_the_motion_nothing_is_promised_for_a_word_that_was_not_counted() -> None:
    assert probability_wrong_along("model_inadequate", rough=False) is None
