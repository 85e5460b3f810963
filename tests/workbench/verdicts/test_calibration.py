"""The probability of being wrong: counts of simulated verdicts, by cell."""

import pytest

from rigwatch.workbench.explain.verdict_calibration import (
    Evidence,
    cases_seen,
    cell_of,
    probability_wrong,
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
