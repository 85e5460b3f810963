"""Several effects at once: each is judged beside the others, and what takes their place is said."""

import dataclasses

import numpy as np
import pytest

from rigwatch.physics.engine.equations.model import model_text
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import explained, ranking
from rigwatch.workbench.explain.sets.several_effects import several_effects
from rigwatch.workbench.explain.verdict import judge
from rigwatch.workbench.ranking.rank import rank
from rigwatch.workbench.ranking.refitting import no_progress
from rigwatch.workbench.report.text_report import explanation_lines
from sim_plant.machines import MACHINES, log
from sim_plant.machines import strength_for as machine_strength
from sim_plant.oscillator import Hidden, strength_for
from tests.workbench.machine import studied
from tests.workbench.simulated import COMMON, fitted, knowing, multisine, with_few_effects

pytestmark = pytest.mark.long

FORCE = multisine(np.arange(0.25, 8.0, 0.25), 4.0)
HIDDEN = ("quadratic_drag", "dead_band", "acceleration_lag")
LABELS = {"quadratic_drag@load", "dead_band@drive", "lag@acceleration_sensor"}


def hiding(*names: str, share: float = 0.1):
    return fitted(FORCE, tuple(Hidden(n, strength_for(n, FORCE, share)) for n in names), 2e-3)


@pytest.fixture(scope="module")
def three():
    return hiding(*HIDDEN)


@pytest.fixture(scope="module")
def rows(three):
    return rank(three.study, three.data, three.base, three.floor)


@pytest.mark.nightly
def test_one_of_three_hidden_effects_is_named_with_another(three, rows):
    alone = judge(three.base, rows, three.floor)
    assert alone.word == "unknown_effect"
    found = several_effects(three, rows, alone, no_progress)
    assert found.word == "missing_effect"
    assert set(found.members) & LABELS
    assert set(found.second) & LABELS - set(found.members)
    assert found.best in rows
    assert found.evidence.left < 0.02
    assert set(found.beside) == LABELS - set(found.members)


def test_each_of_two_effects_has_the_strength_that_it_has_beside_the_other():
    """Alone one stands for a part of the other, and its interval holds what that makes of it."""
    true = {name: strength_for(name, FORCE, 0.1) for name in ("quadratic_drag", "dead_band")}
    bench = fitted(FORCE, tuple(Hidden(*each) for each in true.items()), 2e-3)
    few = knowing(bench.study, "quadratic_drag", "dead_band", "viscous", "coulomb", "gain", "lag")
    found = explained(dataclasses.replace(bench, study=few)).explanation
    assert found.verdict == "missing_effect"
    assert set(found.together) == {"quadratic_drag@load", "dead_band@drive"}
    for label, own in found.together.items():
        assert own["b"].value == pytest.approx(true[label.split("@")[0]], rel=0.005)
    told = explanation_lines(found)
    assert sum(line.startswith("  dead_band@drive: b = 0.424") for line in told) == 1
    assert sum(line.startswith("  quadratic_drag@load: b = 0.258") for line in told) == 1


@pytest.mark.nightly
def test_without_the_truth_among_them_no_effect_is_named_with_confidence(three):
    known = {"quadratic_drag", "dead_band", "lag", "delay", "digital_smoothing", "moving_average"}
    rest = {n: e for n, e in three.study.effects.items() if n not in known}
    study = dataclasses.replace(three.study, effects=rest)
    _, verdict = ranking(dataclasses.replace(three, study=study))
    assert verdict.word in ("unknown_effect", "undetermined")
    assert " together leave " in verdict.text


@pytest.mark.nightly
def test_what_the_best_set_leaves_is_told_if_something_else_is_missing_too():
    bench = hiding("coulomb", "cubic_stiffness", "dead_band")
    outside = {"dead_band", "saturation", "valve_hysteresis", "curvature", "asymmetry", "gain"}
    rest = {n: e for n, e in bench.study.effects.items() if n not in outside}
    _, verdict = ranking(
        dataclasses.replace(bench, study=dataclasses.replace(bench.study, effects=rest))
    )
    assert verdict.word in ("unknown_effect", "undetermined")
    assert "coulomb@load" in verdict.text.partition(" together leave ")[0].rpartition("; ")[2]


@pytest.mark.nightly
def test_two_simple_effects_are_not_taken_for_one_with_a_shape():
    bench = hiding("coulomb", "quadratic_drag")
    _, verdict = ranking(bench)
    assert verdict.word == "missing_effect"
    assert {*verdict.members, *verdict.second} & {"coulomb@load", "quadratic_drag@load"}
    assert "stribeck@load" not in verdict.members


@pytest.mark.nightly
def test_an_effect_with_a_shape_of_its_own_is_not_taken_for_two_simple_ones():
    _, verdict = ranking(with_few_effects(hiding("stribeck"), "stribeck", "quadratic_drag"))
    assert verdict.word == "missing_effect"
    assert "stribeck@load" in verdict.members
    assert verdict.second == ()


@pytest.mark.nightly
def test_friction_that_falls_with_speed_is_not_taken_for_dry_friction_and_drag(tmp_path):
    plant, seed = MACHINES["pendulum"], 114
    hidden = {name: machine_strength(plant, name, 0.1, seed) for name in ("coulomb", "air_drag")}
    tables = [log(plant, hidden, 0.002, number) for number in (seed, seed + 1000)]
    rate = 1 / np.diff(tables[0]["time_s"]).mean()
    named = [{"voltage": t["voltage_V"], "angle": t["angle_rad"]} for t in tables]
    keys = "horizon = 1.0\nstart = { R = 4.0, K = 0.5 }"
    units = {"voltage": "V", "angle": "rad"}
    study = studied(
        tmp_path, model_text("pendulum"), named[:1], named[1:], units, keys, [rate, rate]
    )
    few = knowing(study, "stribeck", "quadratic_drag", *COMMON)
    found, verdict = ranking(open_bench(few))
    falling = next(row for row in found if row.label == "stribeck@shaft")
    # Alone it explains nearly all, and no other effect resembles it.
    assert falling.accepted
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "coulomb@shaft")
    assert verdict.beside == ("quadratic_drag@shaft",)
    rest = "beside quadratic_drag@shaft, which by itself takes the held-out error from "
    assert verdict.text.startswith(rest)
