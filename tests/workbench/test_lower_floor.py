"""The noise floor follows from the best fit where friction fills all bands of the bare residual."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.explain.explain import explained
from rigwatch.workbench.explain.lower_floor import with_lower_floor
from rigwatch.workbench.ranking import Ranked, rank
from rigwatch.workbench.ranking.acceptance import judge_fit
from tests.workbench.dampers import damper


@pytest.fixture(scope="module")
def ranked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bench, list[Ranked]]:
    folder = Path(tmp_path_factory.mktemp("floor"))
    bench = open_bench(damper(folder, lambda _, v: 1000 * np.sign(v)))
    return bench, rank(bench.study, bench.data, bench.base, bench.floor)


def test_the_floor_is_that_of_the_better_fit(ranked: tuple[Bench, list[Ranked]]) -> None:
    bench, rows = ranked
    lower = with_lower_floor(bench, rows).floor
    assert lower.method == bench.floor.method == "quiet band"
    assert lower.rms < 0.6 * bench.floor.rms
    assert with_lower_floor(replace(bench, floor=lower), rows).floor.rms == lower.rms
    told = explained(bench).explanation
    assert told.comparison.noise_floor == pytest.approx(float(lower.rms[0]))


def test_without_an_accepted_effect_or_with_repeated_periods_it_stays(
    ranked: tuple[Bench, list[Ranked]],
) -> None:
    bench, rows = ranked
    refused = [replace(row, accepted=False) for row in rows]
    assert with_lower_floor(bench, refused) is bench
    repeated = replace(bench, floor=replace(bench.floor, method="periods"))
    assert with_lower_floor(repeated, rows).floor.rms == bench.floor.rms


def test_a_fit_that_is_worse_in_training_than_none_is_not_accepted(
    ranked: tuple[Bench, list[Ranked]],
) -> None:
    bench, rows = ranked
    best = replace(next(row for row in rows if row.accepted))
    judge_fit(bench.base, best)
    assert best.accepted
    assert best.fitted is not None
    train = best.fitted.train
    astray = replace(train, residuals=1.2 * np.sign(train.residuals) * bench.base.train_error)
    best.fitted = replace(best.fitted, train=astray)
    judge_fit(bench.base, best)
    assert not best.accepted
    assert "training error rises" in best.reason
