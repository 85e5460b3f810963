"""The probability of being wrong: counts of simulated verdicts, by cell."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.adequacy import stopped_by_outliers, uncalibrated
from rigwatch.workbench.explain.adequacy.adequate import ASTRAY
from rigwatch.workbench.explain.explanation import unlike_logged
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.explain.verdict_calibration import (
    Evidence,
    cases_seen,
    cases_seen_along,
    cell_of,
    most_probably_wrong,
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


def test_a_bound_is_what_the_counts_support_and_few_support_none() -> None:
    assert most_probably_wrong(29, 0) is None
    bound = most_probably_wrong(32, 0)
    assert bound is not None
    assert (1 - bound) ** 32 == pytest.approx(0.05)
    assert most_probably_wrong(32, 1) > bound  # type: ignore[operator]
    assert most_probably_wrong(32, 32) == 1.0


def test_nothing_is_missing_is_not_said_where_outliers_hold_the_error() -> None:
    clean = np.random.default_rng(0).normal(size=(10, 100, 1))
    struck = clean.copy()
    struck[3, 50], struck[8, 20] = 900.0, -900.0
    nothing = Verdict("nothing_missing", None, (), (), "at the floor")
    assert stopped_by_outliers(left(clean), nothing) is nothing
    found = stopped_by_outliers(left(struck), nothing)
    assert found.word == "model_inadequate"
    assert "5 of 1000 samples hold 100% of the held-out error of speed" in found.text
    assert stopped_by_outliers(left(clean, struck), nothing).word == "model_inadequate"


def test_recordings_unlike_the_simulated_ones_are_told() -> None:
    def told(
        samples: int,
        *altered: str,
        along_motion: bool = False,
        later: bool = False,
        remains: float = 0.0,
        converged: bool = True,
    ) -> list[str]:
        held_out = SimpleNamespace(outputs=np.zeros((samples, 1)))
        data: Any = SimpleNamespace(held_out=held_out, altered=altered, along_motion=along_motion)
        study = SimpleNamespace(file=SimpleNamespace(effects=("one",) if later else ()))
        base = SimpleNamespace(convergence=SimpleNamespace(converged=converged))
        bench = cast("Bench", SimpleNamespace(data=data, study=study, base=base))
        return [*uncalibrated(bench), *unlike_logged(bench, remains)]

    missing = "inputs are missing"
    assert told(5120) == []
    assert told(240) == ["only 240 held-out samples count"]
    # First verdicts on free runs of logs with faults have counts of their own.
    assert told(5120, missing) == []
    assert told(5120, missing, along_motion=True) == [missing]
    assert told(5120, missing, later=True) == [missing]
    # What is named on those leaves little.
    assert told(5120, missing, remains=0.2) == ["20% of the error's energy remains"]
    assert told(5120, remains=0.2) == []
    assert told(5120, converged=False) == [ASTRAY]


def left(residuals: FloatArray, healthy: FloatArray | None = None) -> Bench:
    """A study whose model leaves these residuals."""
    base = SimpleNamespace(held_out=SimpleNamespace(residuals=residuals))
    bare = (
        healthy if healthy is None else SimpleNamespace(held_out=SimpleNamespace(residuals=healthy))
    )
    model = SimpleNamespace(outputs={"speed": None})
    return cast("Bench", SimpleNamespace(study=SimpleNamespace(model=model), base=base, bare=bare))
