"""A fit that ended in a local minimum is begun again, before what it leaves is called an effect."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import Bench, open_bench, with_base
from rigwatch.workbench.explain.explain import explained
from rigwatch.workbench.explain.sets.combination import Combination
from rigwatch.workbench.explain.sets.several_effects import _judge_each
from rigwatch.workbench.fit import (
    Fitted,
    another_start,
    begun_from_given,
    begun_from_larger,
    fit_model,
)
from rigwatch.workbench.ranking import Ranked, no_progress, rank, rank_all
from rigwatch.workbench.steps.trial import _tried
from rigwatch.workbench.study.study import open_study
from tests.workbench.fits.test_accepted_fit import UNITS, WAVES, waves
from tests.workbench.machine import studied

GIVEN = WAVES.replace("0.074", "0.02")
"""The wave number of the recordings, 2 rad/m, in the file's unit."""
NOISE = 0.05
STORED = """
[[effects]]
effect = "constant_force"
port = "load"
parameters = {{ F0 = 4.0 }}
model = {{ a = 1.0, w = {w} }}
"""


def force(seed: int, constant: float) -> dict[str, np.ndarray]:
    """3 N·sin(2 rad/m · position) and a constant force [N]."""
    table = waves(seed)
    return table | {"force": table["force"] - 4.0 + constant}


def bench_of_waves(folder: Path, constant: float) -> Bench:
    recorded = [force(0, constant)], [force(1, constant)]
    return open_bench(studied(folder, GIVEN, *recorded, UNITS))


def astray(bench: Bench, wave_number: float) -> Bench:
    """The model alone in the local minimum near a wave number [rad/m]."""
    found = fitted_with(bench, (), {"a": 1.0, "w": wave_number})
    assert found.train_error > 1.9
    return with_base(bench, found)


def fitted_with(bench: Bench, rows: Sequence[Ranked], start: dict[str, float]) -> Fitted:
    """The model with effects, fitted from values of its own parameters."""
    placements = [row.placement for row in rows]
    return fit_model(bench.study, bench.data, placements, start, bench.base.train.scale)


@pytest.mark.parametrize("wave_number", [4.0, 5.0, 9.0])
def test_no_effect_is_named_where_only_the_fit_has_gone_astray(
    wave_number: float, tmp_path: Path
) -> None:
    bench, said = astray(bench_of_waves(tmp_path, 0.0), wave_number), list[str]()
    found = explained(bench, said.append)
    assert found.explanation.verdict == "nothing_missing"
    assert found.explanation.comparison.held_out_error < 1.1 * NOISE
    assert found.bench.base.train.values()["w"] == pytest.approx(2.0, rel=0.01)
    assert any("ranking the effects again" in line for line in said)


def test_an_effect_is_ranked_and_added_by_its_fit_from_the_given_values(tmp_path: Path) -> None:
    bench = astray(bench_of_waves(tmp_path, 4.0), 5.0)
    rows = rank(bench.study, bench.data, bench.base, bench.floor)
    tried = _tried(bench, "constant_force", "load")
    assert rows[0].label == "constant_force@load"
    for row in (rows[0], tried):
        assert row.accepted
        assert row.held_out_error < 1.1 * NOISE


@pytest.mark.parametrize("wave_number", [0.02, 0.05])
def test_an_accepted_fit_is_begun_again_if_it_leaves_more_than_noise(
    wave_number: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right, begun = wave_number == 0.02, list[str]()
    file = bench_of_waves(tmp_path, 4.0).study.folder / "study.toml"
    file.write_text(file.read_text("utf-8") + STORED.format(w=wave_number), "utf-8")

    def again(*arguments, **more):
        begun.append("the given values")
        return fit_model(*arguments, **more)

    monkeypatch.setattr(another_start, "fit_model", again)
    bench = open_bench(open_study(file.parent))
    assert bench.base.held_out_error < 1.1 * NOISE
    assert bench.floor.rms < 1.1 * NOISE
    assert len(begun) == (0 if right else 1)
    assert bench.base.convergence is not None
    assert bench.base.convergence.begun == ("the accepted fit" if right else "the given values")


def test_an_effect_that_only_led_another_out_of_its_minimum_is_not_judged_beside_it(
    tmp_path: Path,
) -> None:
    bench = bench_of_waves(tmp_path, 4.0)
    rows = {row.label: row for row in rank_all(bench.study, bench.data, bench.base)}
    constant, spring = rows["constant_force@load"], rows["linear_stiffness@load"]
    constant.fitted = fitted_with(bench, (constant,), {"a": 1.0, "w": 5.0})
    spring.fitted = fitted_with(bench, (constant, spring), {"a": 3.0, "w": 2.0})
    assert constant.fitted.held_out_error > 1.8
    better, judged = _judge_each(bench, Combination((constant, spring)), no_progress)
    assert better is not None
    assert better.labels == {"constant_force@load"}
    assert better.fitted.held_out_error < 1.1 * NOISE
    assert not judged


def test_the_fit_stays_where_another_start_leads_to_no_better_one(tmp_path: Path) -> None:
    bench = bench_of_waves(tmp_path, 4.0)
    study, data, best = bench.study, bench.data, _tried(bench, "constant_force", "load").fitted
    assert best is not None
    assert begun_from_given(study, data, best) is best
    assert begun_from_larger(study, data, bench.base, best) is bench.base
    # What is no better held out has only followed the training.
    worse = replace(best, held_out=replace(best.held_out, residuals=0 * best.held_out.residuals))
    astray_with = fit_model(
        study, data, best.placements, best.train.values() | {"w": 5.0}, best.train.scale
    )
    assert astray_with.train_error > 1.9
    assert begun_from_given(study, data, astray_with) is not astray_with
    lucky = replace(astray_with, held_out=worse.held_out)
    assert begun_from_given(study, data, lucky) is lucky
