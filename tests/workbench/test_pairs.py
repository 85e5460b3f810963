"""Pairs of effects: scored from the ranking of single ones, fitted, and named together."""

import numpy as np
import pytest

from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.pairs import _pair, likely_pairs, two_effects
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking.rank import SIMILAR, rank, unheard
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.simulated import fitted, multisine

FORCE = multisine(np.arange(0.25, 8.0, 0.25), 1.0)
PAIR = ("coulomb@load", "cubic_stiffness@load")


@pytest.fixture(scope="module")
def bench():
    share = 0.05 / np.sqrt(2)
    hidden = tuple(Hidden(n, strength_for(n, FORCE, share)) for n in ("coulomb", "cubic_stiffness"))
    return fitted(FORCE, hidden, 2e-3)


@pytest.fixture(scope="module")
def rows(bench):
    return rank(bench.study, bench.data, bench.base, bench.floor)


def test_a_pair_explains_what_least_squares_of_both_directions_would(rows):
    for one, other in [(rows[0], rows[1]), (rows[0], rows[2])]:
        found = _pair(one, other)
        cosine = one.turned[other.label]
        assert one.cosines[other.label] == pytest.approx(abs(cosine))
        gram = np.array([[1.0, cosine], [cosine, 1.0]])
        along = np.sqrt([one.explained, other.explained])
        if found is not None:
            assert found.explained == pytest.approx(along @ np.linalg.solve(gram, along))
        else:
            assert abs(cosine) > SIMILAR or (np.linalg.solve(gram, along) <= 0).any()


def test_the_two_that_are_hidden_are_the_likeliest_pair(bench, rows):
    first = likely_pairs(bench, rows)[0]
    assert {first.one.label, first.other.label} == set(PAIR)


def test_both_are_named_and_the_ranking_shows_each_alone(bench, rows):
    alone = judge(bench.base, rows, bench.floor)
    found = two_effects(bench, rows, alone, unheard)
    assert found.word == "missing_effect"
    assert {found.members[0], found.second[0]} == set(PAIR)
    assert found.best in rows
    labels = [row.label for row in ranking(bench)[0]]
    assert len(labels) == len(set(labels))


def test_a_pair_that_leaves_more_than_noise_is_not_named(bench, rows):
    alone = judge(bench.base, rows, bench.floor)
    others = [row for row in rows if row.label not in PAIR]
    assert two_effects(bench, others, alone, unheard) is alone
