"""The fit that an effect was accepted with is the one that stays in the study."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.ranking.ranked import accepted_from
from rigwatch.workbench.steps.change import add, undo
from rigwatch.workbench.steps.ledger_replay import replay
from rigwatch.workbench.steps.trial import keeps_gain
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.dampers import damper
from tests.workbench.machine import studied

WAVES = """
name = "waves"
summary = "A force that goes up and down with position: its wave number has many local minima."
inputs.position = { unit = "m" }
parameters.a = { value = 1.0, unit = "N" }
parameters.w = { value = 0.074, unit = "1/cm" }
outputs.force = { unit = "N", expression = "a*sin(w*position) + load" }
ports.load = { kind = "force", unit = "N", variables.x = { expression = "position", unit = "m" } }
"""
UNITS = {"position": "m", "force": "N"}


def waves(seed: int) -> dict[str, np.ndarray]:
    position = 1.5 * np.sin(np.arange(400) / (9 + seed))
    noise = np.random.default_rng(seed).normal(size=400)
    return {"position": position, "force": 3 * np.sin(2 * position) + 4 + 0.05 * noise}


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return studied(tmp_path, WAVES, [waves(0)], [waves(1)], UNITS)


def test_the_headline_and_the_table_are_of_one_fit(study: Study) -> None:
    change = add(study, "constant_force")
    assert change.step == "add"
    assert "→ 0.045" in change.text
    assert change.after.held_out_error == pytest.approx(0.0456, rel=0.02)
    again = compare(open_study(study.folder))
    assert again.held_out_error == pytest.approx(change.after.held_out_error, rel=1e-6)
    # In the model file's unit: 2 rad/m.
    assert again.parameters["w"].value == pytest.approx(0.02, rel=0.01)


def test_a_second_step_keeps_the_values_of_the_first(study: Study) -> None:
    add(study, "constant_force")
    change = add(open_study(study.folder), "linear_stiffness", anyway=True)
    assert change.after.held_out_error < 0.06
    assert "load_constant_force_" in (study.folder / "study.toml").read_text()


def test_undoing_the_step_takes_its_fit_away_and_the_ledger_repeats_both(study: Study) -> None:
    before = compare(study).parameters["w"].value
    add(study, "constant_force")
    undo(open_study(study.folder))
    again = open_study(study.folder)
    assert compare(again).parameters["w"].value == pytest.approx(before)
    assert [check.same for check in replay(again)] == [True, True]


def test_a_step_that_gets_worse_when_it_is_fitted_again_is_refused(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if the file could not keep the fit: it begins at the model file's values again.
    keeps = "rigwatch.workbench.steps.trial.accepted_with_model"
    monkeypatch.setattr(keeps, accepted_from)
    before = (study.folder / "study.toml").read_bytes()
    change = add(study, "constant_force")
    assert change.step == "refused"
    assert "refitted, it leaves 1.9" in change.text
    assert (study.folder / "study.toml").read_bytes() == before


def named(study: Study) -> tuple[str, str]:
    """The effect that is named as missing, and what is said of the one tried here."""
    rows, verdict = ranking(open_bench(study))
    tried = next(row for row in rows if row.label == "constant_force@load")
    best = verdict.best.label if verdict.best and verdict.word == "missing_effect" else ""
    return best, tried.reason


def test_what_add_refused_is_not_named_again_before_the_study_changes(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert named(study)[0] == "constant_force@load"
    monkeypatch.setattr("rigwatch.workbench.steps.trial.accepted_with_model", accepted_from)
    assert add(study, "constant_force").step == "refused"
    best, reason = named(open_study(study.folder))
    assert best != "constant_force@load"
    assert reason.startswith("as `add` found: refitted, it leaves 1.9")
    file = study.folder / "study.toml"
    file.write_text(file.read_text("utf-8") + "\n# looked at again\n", encoding="utf-8")
    assert named(open_study(study.folder))[0] == "constant_force@load"


@pytest.mark.parametrize(("left", "kept"), [(1.009, True), (1.09, True), (1.2, False)])
def test_a_refit_must_keep_the_gain_or_end_below_the_floor(left: float, kept: bool) -> None:
    assert keeps_gain(2.0, 1.0, left, floor=0.5) is kept
    assert keeps_gain(2.0, 1.0, left, floor=1.3)


def test_a_refit_of_a_small_gain_may_differ_by_rounding() -> None:
    assert keeps_gain(1.04, 1.0, 1.009, floor=0.5)
    assert not keeps_gain(1.04, 1.0, 1.03, floor=0.5)


def test_the_step_tells_the_error_of_the_model_that_it_keeps(study: Study) -> None:
    change = add(study, "constant_force")
    assert change.tried == (change.after.train_error, change.after.held_out_error)
    assert f"→ {change.after.held_out_error:.4g} " in change.text


def test_an_elective_effect_is_not_ranked_and_may_be_added(study: Study) -> None:
    bench = open_bench(study)
    assert "stop_above" not in {row.effect for row in ranking(bench)[0]}
    assert add(study, "stop_above", anyway=True).step == "add"


def test_an_unknown_parameter_of_an_accepted_effect_is_refused_with_those_that_it_has(
    study: Study,
) -> None:
    add(study, "constant_force")
    file = study.folder / "study.toml"
    file.write_text(file.read_text("utf-8").replace("{ F0 =", "{ F ="), "utf-8")
    with pytest.raises(ModelError, match=r"load_constant_force_F', .*load_constant_force_F0"):
        open_bench(open_study(study.folder))


def by_direction(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Dry friction of 0.3 N more one way than the other."""
    return np.asarray(0.8 * np.sign(v) + 0.3 * np.abs(np.sign(v)))


def test_an_effect_has_no_parameters_of_another_whose_name_begins_like_its_own(
    tmp_path: Path,
) -> None:
    study = damper(tmp_path, by_direction)
    add(study, "coulomb_by_direction", anyway=True)
    change = add(open_study(study.folder), "coulomb")
    assert change.step == "add"
    last = open_study(study.folder).file.effects[-1]
    assert {*last.parameters} == {"Fc", "vs"}
    assert {"load_coulomb_by_direction_dF", "c"} <= {*last.model}


VALVE = """
name = "valve"
summary = "A flow in proportion to what passes a valve."
inputs.u = { unit = "V", hold = "zero" }
parameters.k = { value = 1.0, unit = "m^3/(s*V)" }
outputs.flow = { unit = "m^3/s", expression = "k*drive" }
ports.drive = { kind = "actuator", signal = "u" }
"""


def overlapped(seed: int) -> dict[str, np.ndarray]:
    """A valve whose zero is off by 0.4 V, before its overlap of 0.5 V."""
    u = 3.0 * np.sin(np.arange(400) / (9 + seed)) + np.sin(np.arange(400) / 3.1)
    moved = u + 0.4
    passed = np.sign(moved) * np.maximum(np.abs(moved) - 0.5, 0.0)
    return {"u": u, "flow": 2 * passed + 0.01 * np.random.default_rng(seed).normal(size=400)}


def test_the_ledger_repeats_an_effect_that_a_signal_passes_before_an_earlier_one(
    tmp_path: Path,
) -> None:
    units = {"u": "V", "flow": "m^3/s"}
    study = studied(tmp_path, VALVE, [overlapped(0)], [overlapped(1)], units)
    add(study, "dead_band", anyway=True)
    add(open_study(study.folder), "offset", "drive")
    again = open_study(study.folder)
    assert again.file.effects[-1].ahead
    assert [check.same for check in replay(again)] == [True, True]
