"""Which sets of effects the search extends, and which effects their members are compared with."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigwatch.physics.engine.equations.system import Placement
from rigwatch.workbench.compare import Bench, open_bench
from rigwatch.workbench.explain import with_whole_library
from rigwatch.workbench.explain.sets.combination import Combination, best_in_training, with_rows
from rigwatch.workbench.explain.sets.combinations import _substitutes
from rigwatch.workbench.explain.sets.enlarging import all_fitted, all_tried, scored_with
from rigwatch.workbench.explain.sets.several_effects import _judge_each, _ranked_with
from rigwatch.workbench.ranking import candidates, no_progress, rank, refit, scored
from rigwatch.workbench.ranking.rank import (
    _substitute_of_vague,
    _substitutes_of_refused,
    _unfitted_similar,
)
from rigwatch.workbench.ranking.ranked import Ranked
from tests.workbench.dampers import damper


def effect(label: str, alike: tuple[str, ...] = (), family: str = "") -> Ranked:
    name, port = label.split("@")
    unused: Any = SimpleNamespace(family=family)
    return Ranked(Placement(name, unused, port), "force", 0.0, 0.5, {}, list(alike), {}, {})


LAG = effect("lag@pump", ("smoothing@pump", "lag@level"))
SMOOTHING = effect("smoothing@pump", ("lag@pump",))
LEVEL = effect("lag@level", ("lag@pump",))
LIMIT, LEAK = effect("saturation@pump"), effect("leak@tank")


@pytest.mark.parametrize(
    ("level", "extended"),
    [
        ([(LAG,), (SMOOTHING,), (LEVEL,), (LIMIT,)], [(LAG,), (LEVEL,), (LIMIT,)]),
        ([(SMOOTHING, LIMIT), (LIMIT, LAG), (LAG, LEAK)], [(SMOOTHING, LIMIT), (LAG, LEAK)]),
    ],
    ids=["at another port it is another place", "in any order beside the same effect"],
)
def test_of_effects_that_look_alike_at_one_port_the_better_is_extended(
    level: list[tuple[Ranked, ...]], extended: list[tuple[Ranked, ...]]
) -> None:
    sets = [Combination(rows, float(place)) for place, rows in enumerate(level)]
    found = best_in_training(list(reversed(sets)))
    assert [each.rows for each in found] == extended


def test_an_effect_is_exchanged_for_what_resembles_it_at_any_port_or_is_of_its_family() -> None:
    offset = effect("offset@angle", ("force@shaft", "smoothing@angle"))
    presliding = effect("bliman_sorine@shaft", (), "dry friction")
    coulomb, force = effect("coulomb@shaft", (), "dry friction"), effect("force@shaft")
    smoothing, other = effect("smoothing@angle"), effect("leak@tank")
    every = [other, offset, force, presliding, smoothing, coulomb]
    assert _substitutes(offset, every) == [smoothing, force]
    assert _substitutes(presliding, every) == [coulomb]
    assert _substitutes(other, every) == []


def test_what_was_skipped_for_an_effect_of_open_strength_is_fitted_at_its_port() -> None:
    convection, radiation = effect("convection@loss"), effect("radiation@loss")
    offset = effect("offset@heater")
    radiation.fitted_instead = offset.fitted_instead = "convection@loss"
    every = [convection, offset, radiation]
    assert _substitute_of_vague(every) is None
    convection.vague = True
    assert _substitute_of_vague(every) is radiation
    radiation.failure = "diverges"
    assert _substitute_of_vague(every) is None


@pytest.mark.parametrize(("explained", "tried"), [(0.99, True), (0.3, False)])
def test_what_was_skipped_for_an_effect_that_explains_most_only_to_first_order_is_fitted(
    explained: float, *, tried: bool
) -> None:
    base: Any = SimpleNamespace(train=SimpleNamespace(continued=False))
    limit, lag = effect("slew_limit@drive"), effect("lag@drive")
    limit.fitted, limit.explained, lag.fitted_instead = base, explained, "slew_limit@drive"
    lag.likely = True
    assert _substitutes_of_refused(base, [limit, lag]) == ([lag] if tried else [])
    limit.accepted = True
    assert _substitutes_of_refused(base, [limit, lag]) == []


def test_an_effect_of_a_set_is_compared_though_it_looks_like_another(tmp_path: Path) -> None:
    study = damper(tmp_path, lambda x, v: 4 * np.sign(v) + 2e6 * x**3 + 2.0)
    bench = open_bench(study)
    stiffer = {row.label: row for row in rank(study, bench.data, bench.base, bench.floor)}
    rest = Combination((stiffer["cubic_stiffness@load"],))
    beside = rank(with_rows(study, rest.rows), bench.data, rest.fitted, bench.floor)
    own = next(row for row in beside if row.fitted_instead and row.fitted is None)
    found = {row.label: row for row in _ranked_with(bench, rest, own, rest, bench.floor)}
    assert found[own.label].fitted is not None
    assert found["coulomb@load"].accepted


@pytest.mark.parametrize(("reached", "fitted_next"), [(False, "jenkins@load"), (True, None)])
def test_above_the_floor_a_relative_of_the_best_is_fitted_though_it_looks_like_another(
    reached: bool, fitted_next: str | None
) -> None:
    best, third, waiting = (effect(f"{name}@load") for name in ("bouc_wen", "dahl", "jenkins"))
    best.placement.effect.confused_with = ("jenkins", "linear_stiffness")  # type: ignore[misc]
    waiting.fitted_instead = third.label
    for row, error in ((best, 2.4), (third, 4.0)):
        fit: Any = SimpleNamespace(held_out=None, held_out_error=error)
        row.fitted, row.accepted = fit, True
    floor: Any = SimpleNamespace(reached=lambda _: reached)
    found = _unfitted_similar([best, third, waiting], floor)
    assert (found and found.label) == fitted_next


def test_what_was_skipped_for_an_effect_that_may_be_named_in_place_of_the_best_is_fitted() -> None:
    names = ("bliman_sorine", "load_dependent", "coulomb")
    best, simpler, waiting = (effect(f"{name}@load") for name in names)
    best.placement.effect.confused_with = ()  # type: ignore[misc]
    waiting.fitted_instead = simpler.label
    for row, error in ((best, 2.5), (simpler, 2.7)):
        fit: Any = SimpleNamespace(held_out=None, held_out_error=error)
        row.fitted, row.accepted = fit, True
    for row in (simpler, waiting):
        row.placement.effect.free = 1  # type: ignore[misc]
    floor: Any = SimpleNamespace(reached=lambda _: False)
    assert _unfitted_similar([best, simpler, waiting], floor) is waiting
    simpler.fitted.held_out_error = 4.0  # type: ignore[union-attr,misc]
    assert _unfitted_similar([best, simpler, waiting], floor) is None


def test_a_needless_effect_is_left_out_of_a_set_before_the_others_are_judged(
    tmp_path: Path,
) -> None:
    study = damper(tmp_path, lambda x, v: 4 * np.sign(v) + 2e6 * x**3 + 2.0)
    bench = open_bench(study)
    rows = list[Ranked]()
    for label in ("cubic_stiffness@load", "coulomb@load", "quadratic_drag@load"):
        base = (rows[-1].fitted if rows else None) or bench.base
        held = with_rows(study, rows)
        every = scored(held, bench.data, base, candidates(held, bench.data.train), every=True)
        row = next(row for row in every if row.label == label)
        refit(held, bench.data, base, row)
        rows.append(row)
    better, parts = _judge_each(bench, Combination(tuple(rows)), no_progress)
    assert better is not None
    assert better.labels == {"cubic_stiffness@load", "coulomb@load"}
    assert not parts


def test_a_second_pass_extends_the_sets_of_the_first_by_rarer_effects(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 0.8 * np.sign(v)))
    row = next(
        row
        for row in scored(
            bench.study, bench.data, bench.base, candidates(bench.study, bench.data.train)
        )
        if row.label == "coulomb@load"
    )
    refit(bench.study, bench.data, bench.base, row)
    usual = {each.effect for each in scored_with(bench, Combination((row,)))}
    wider = replace(bench, study=with_whole_library(bench.study))
    rarer = {each.effect for each in scored_with(wider, Combination((row,)))} - usual
    assert rarer
    assert all(bench.study.effects[name].elective for name in rarer)
    assert usual == {each.effect for each in scored_with(bench, Combination((row,)))}


@pytest.mark.nightly
def test_a_set_that_a_second_pass_makes_once_more_is_fitted_once(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 4 * np.sign(v) + 2e6 * x**3 + 2.0))
    rows = {row.label: row for row in rank(bench.study, bench.data, bench.base, bench.floor)}
    stiffer = Combination((rows["cubic_stiffness@load"],))

    def extended(pass_: Bench) -> Combination:
        beside = {row.label: row for row in scored_with(pass_, stiffer)}
        (larger,) = all_tried(pass_, [(stiffer, beside["coulomb@load"])])
        (made,) = all_fitted(pass_, [larger])
        return made

    first = extended(bench)
    second = extended(replace(bench, study=with_whole_library(bench.study)))
    assert second.fitted is first.fitted
    assert second.rows[-1].accepted == first.rows[-1].accepted
