"""Pairs of effects: scored from the ranking of single ones, fitted, and named together."""

import dataclasses

import numpy as np
import pytest

from rigwatch.physics.engine.compile import all_cores, turns
from rigwatch.workbench.explain.explain import _by_pairs, _unless_open, ranking
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.sets import pairs
from rigwatch.workbench.explain.sets.pairs import Pair, _pair, likely_pairs, two_effects
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking import refitting
from rigwatch.workbench.ranking.rank import rank
from rigwatch.workbench.ranking.ranked import SIMILAR, Ranked
from rigwatch.workbench.ranking.refitting import no_progress
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import fitted, multisine, with_few_effects

FORCE = multisine(np.arange(0.25, 8.0, 0.25), 1.0)
PAIR = ("coulomb@load", "cubic_stiffness@load")


@pytest.fixture(scope="module")
def bench():
    share = 0.05 / np.sqrt(2)
    hidden = tuple(Hidden(n, strength_for(n, FORCE, share)) for n in ("coulomb", "cubic_stiffness"))
    return with_few_effects(fitted(FORCE, hidden, 2e-3))


@pytest.fixture(scope="module")
def rows(bench):
    return rank(bench.study, bench.data, bench.base, bench.floor)


def test_the_ranking_does_not_depend_on_the_number_of_cores(bench, rows, monkeypatch):
    for module in (all_cores, turns, refitting):
        monkeypatch.setattr(module, "cores", lambda: 5)

    def told(found):
        return [(row.label, row.held_out_error, row.accepted, row.reason) for row in found]

    assert told(rank(bench.study, bench.data, bench.base, bench.floor)) == told(rows)


def pair_of(rows: list[Ranked], explained: tuple[float, float], cosine: float) -> Pair | None:
    """The pair of two effects that explain so much alone and have this cosine."""
    one, other = (
        dataclasses.replace(row, explained=share, signed_cosines={beside.label: cosine})
        for row, beside, share in zip(rows[:2], rows[1::-1], explained, strict=True)
    )
    return _pair(one, other)


@pytest.mark.parametrize(
    ("explained", "cosine"),
    [((0.5, 0.3), 0.2), ((0.3, 0.5), 0.2), ((0.5, 0.3), -0.6), ((0.5, 0.3), 0.0)],
)
def test_a_pair_explains_what_least_squares_of_both_directions_would(
    rows: list[Ranked], explained: tuple[float, float], cosine: float
) -> None:
    found = pair_of(rows, explained, cosine)
    assert found is not None
    assert found.one.explained == max(explained)
    along = np.sqrt(explained)
    gram = np.array([[1.0, cosine], [cosine, 1.0]])
    assert found.explained == pytest.approx(along @ np.linalg.solve(gram, along))


@pytest.mark.parametrize(
    ("explained", "cosine"),
    [
        pytest.param((0.5, 0.3), SIMILAR + 0.01, id="alike"),
        pytest.param((0.5, 0.3), -SIMILAR - 0.01, id="opposite and alike"),
        pytest.param((0.5, 0.05), 0.6, id="the second would turn its sign"),
    ],
)
def test_no_pair_is_made_of_one_effect_or_of_one_with_the_wrong_sign(
    rows: list[Ranked], explained: tuple[float, float], cosine: float
) -> None:
    assert pair_of(rows, explained, cosine) is None


def test_a_cosine_with_a_sign_has_the_size_of_the_one_without(rows: list[Ranked]) -> None:
    for one in rows[:3]:
        for other in rows[:3]:
            if one is not other:
                assert abs(one.signed_cosines[other.label]) == pytest.approx(
                    one.cosines[other.label]
                )


def test_the_two_that_are_hidden_are_the_likeliest_pair(bench, rows):
    first = likely_pairs(bench, rows)[0]
    assert {first.one.label, first.other.label} == set(PAIR)


@pytest.mark.nightly
def test_both_are_named_and_the_ranking_shows_each_alone(bench, rows):
    alone = judge(bench.base, rows, bench.floor)
    found = two_effects(bench, rows, alone, no_progress)
    assert found.word == "missing_effect"
    assert {found.members[0], found.second[0]} == set(PAIR)
    assert found.best in rows
    labels = [row.label for row in ranking(bench)[0]]
    assert len(labels) == len(set(labels))


def test_a_pair_is_undetermined_if_one_may_have_no_strength(bench, rows):
    verdict = two_effects(bench, rows, judge(bench.base, rows, bench.floor), no_progress)
    found = explanation(bench, rows, verdict)
    assert set(found.together) == set(PAIR)
    assert _unless_open(found, verdict) is found
    friction = found.together["coulomb@load"]
    none = dataclasses.replace(friction["Fc"], interval=(-0.01, friction["Fc"].value))
    open_one = found.together | {"coulomb@load": friction | {"Fc": none}}
    doubted = _unless_open(dataclasses.replace(found, together=open_one), verdict)
    assert (doubted.verdict, doubted.wrong_probability) == ("undetermined", None)
    assert doubted.text.endswith("but the interval of Fc of coulomb@load holds 0")


def test_a_pair_that_leaves_more_than_noise_is_not_named(bench, rows):
    alone = judge(bench.base, rows, bench.floor)
    others = [row for row in rows if row.label not in PAIR]
    assert two_effects(bench, others, alone, no_progress) is alone


def test_a_pair_whose_effects_are_not_named_beside_each_other_gives_way_to_the_next(
    bench, rows, monkeypatch
):
    alone, by_label = judge(bench.base, rows, bench.floor), {row.label: row for row in rows}
    right = likely_pairs(bench, rows)[0]
    other = next(row for row in rows if row.label not in PAIR and row.fitted is not None)
    finer = Pair(by_label["cubic_stiffness@load"], other, right.explained, right.start)
    ((_, fit),) = pairs._fitted(bench, [right], no_progress)
    monkeypatch.setattr(pairs, "_fitted", lambda *_: [(finer, fit), (right, fit)])
    found = two_effects(bench, rows, alone, no_progress)
    assert {found.members[0], found.second[0]} == set(PAIR)


def test_no_pair_is_named_where_one_effect_acts_alone(bench, rows, monkeypatch):
    alone = judge(bench.base, rows, bench.floor)
    monkeypatch.setattr(pairs, "acts_alone", lambda *_: True)
    found = two_effects(bench, rows, alone, no_progress)
    assert found == dataclasses.replace(alone, alone=True)


def along_motion(bench, times):
    """The study as along a measured motion, with a noise floor so many times as high."""
    floor = dataclasses.replace(bench.floor, rms=times * bench.floor.rms, method="healthy motion")
    data = dataclasses.replace(bench.data, along_motion=True)
    return dataclasses.replace(bench, floor=floor, data=data)


def named_alone(bench, rows):
    found = judge(bench.base, rows, bench.floor)
    return dataclasses.replace(found, word="missing_effect")


@pytest.mark.nightly
def test_a_second_effect_is_named_where_noise_hides_most_of_what_the_first_leaves(bench, rows):
    alone = named_alone(bench, rows)
    noisy = along_motion(bench, bench.floor.ratio(alone.best.fitted.held_out) / 1.2)
    found = _by_pairs(noisy, rows, alone, no_progress)
    assert {found.members[0], found.second[0]} == set(PAIR)


@pytest.mark.nightly
def test_a_part_of_the_residual_speaks_for_a_pair_only_if_it_leaves_nothing(bench, rows):
    alone, quiet = named_alone(bench, rows), along_motion(bench, 1 / 1.2)
    assert two_effects(quiet, rows, alone, no_progress, tolerant=False) is alone
    assert two_effects(quiet, rows, alone, no_progress).second
