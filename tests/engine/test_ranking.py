"""The one ranker: what stands where in which shapes, the best shape of each, and classes."""

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.score.candidates import candidates, root_mean_square, sizes_at_port
from rigwatch.physics.engine.score.ranking import Standing, cosines_with, freed, standings
from rigwatch.physics.engine.score.score_test import Projector, Scores, best_of, score
from rigwatch.wire.arrays import FloatArray

EFFECTS = library()
SIZES = {"x": 0.03, "v": 0.5, "L": 6.0, "dt": 1 / 256}


def scored(*directions: FloatArray, residual: FloatArray) -> Scores:
    nothing = np.zeros((1, len(residual), 0))
    moved = np.stack(directions, axis=1)[None]
    return score(residual[None], moved, Projector(nothing, nothing), 1.0)


def ranked(
    labels: list[str], scores: Scores, allowed: list[bool] | None = None
) -> dict[str, Standing]:
    return {row.label: row for row in standings(labels, scores, scores.corrected, allowed)}


AXES = np.eye(6)
RESIDUAL = np.array([5.0, 4.0, 3.0, 0.0, 0.0, 0.0])


def test_the_best_shape_of_a_label_counts_and_those_that_explain_most_come_first() -> None:
    scores = scored(AXES[2], AXES[1], AXES[0], residual=RESIDUAL)
    rows = standings(["a", "b", "a"], scores, scores.corrected)
    assert [(row.label, row.index) for row in rows] == [("a", 2), ("b", 1)]
    assert [row.explained for row in rows] == pytest.approx([0.5, 0.32])
    assert [row.strength for row in rows] == pytest.approx([5.0, 4.0])


def test_a_shape_whose_strength_makes_no_sense_is_passed_over() -> None:
    scores = scored(AXES[2], AXES[1], AXES[0], residual=RESIDUAL)
    assert ranked(["a", "b", "a"], scores, [True, False, False]).keys() == {"a"}
    assert ranked(["a", "b", "a"], scores, [True, False, False])["a"].index == 0


def test_cosines_have_a_sign_by_how_both_explain_the_residual_and_a_class_has_none() -> None:
    near = AXES[0] + 0.1 * AXES[3]
    scores = scored(AXES[0], -near, AXES[0] - 2 * AXES[1], residual=RESIDUAL)
    rows = ranked(["a", "near", "against"], scores)
    assert rows["a"].signed_cosines["near"] == pytest.approx(1 / np.hypot(1, 0.1))
    assert rows["a"].alike == ["near"]
    assert rows["near"].alike == ["a"]
    assert rows["a"].signed_cosines["against"] == pytest.approx(-1 / np.sqrt(5))
    assert rows["a"].cosines["against"] == pytest.approx(1 / np.sqrt(5))


def test_the_best_of_many_is_less_surprising_than_one_alone() -> None:
    alone = np.array([0.01, 0.5])
    assert best_of(alone, 1) == pytest.approx(alone)
    assert best_of(alone, 10) == pytest.approx(1 - (1 - alone) ** 10)
    assert best_of(np.array([1.0]), 10) == pytest.approx(1.0)


def test_what_is_fitted_already_is_taken_out_of_a_direction() -> None:
    units = freed(np.stack([AXES[0] + AXES[1], AXES[1], AXES[2]], axis=1), AXES[:, [1]])
    assert pytest.approx(np.stack([AXES[0], np.zeros(6), AXES[2]])) == units.T
    assert cosines_with(units, 0) == pytest.approx([1.0, 0.0, 0.0])


def test_every_effect_stands_where_it_can_in_each_of_its_shapes() -> None:
    wanted = {("coulomb", "load"), ("stribeck", "load"), ("coulomb", "other")}
    found = candidates(
        ["load", "other"],
        {name: EFFECTS[name] for name in ("coulomb", "stribeck")},
        lambda name, port: EFFECTS[name].scaled(SIZES) if (name, port) in wanted else None,
    )
    assert {(c.name, c.port) for c in found} == wanted
    assert {c.label for c in found} == {"coulomb@load", "stribeck@load", "coulomb@other"}
    for name, port in wanted:
        shapes = [tuple(c.shape.items()) for c in found if (c.name, c.port) == (name, port)]
        tried = [len(p.tried) or 1 for p in EFFECTS[name].parameters.values() if p.role == "shape"]
        assert len(shapes) == len(set(shapes)) == np.prod(tried)


def test_sizes_are_root_mean_squares_and_a_silent_signal_has_one_to_divide_by() -> None:
    wave = np.array([3.0, -3.0, np.nan, 3.0])
    sizes = sizes_at_port({"v": wave, "x": np.zeros(4)}, np.arange(4.0), 0.5)
    rms = np.sqrt(np.mean([0.0, 1.0, 4.0, 9.0]))
    assert sizes == pytest.approx({"dt": 0.5, "v": 3.0, "x": 1.0, "u": rms, "rate": 2.0})
    assert sizes_at_port({}, None, 0.5) == {"dt": 0.5}
    assert root_mean_square(np.array([-2.0])) == 2.0
