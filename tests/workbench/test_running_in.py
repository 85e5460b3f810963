"""Friction that runs in: the path since a recording's beginning is counted, not fitted."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import evaluate, fit
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain import explain
from rigwatch.workbench.explain.exchange import exchange
from rigwatch.workbench.ranking import no_progress
from rigwatch.workbench.steps.change import add, undo
from rigwatch.workbench.study import open_study
from tests.workbench.dampers import damper
from tests.workbench.machine import studied
from tests.workbench.studies.test_recordings_apart import DAMPER, UNITS

STIFFNESS, LIMIT, MORE, PATH = 8e3, 20.0, 0.6, 0.15
MODEL = shipped_models()["mass-spring-damper"]


def settling(x: np.ndarray, _: np.ndarray, more: float = MORE) -> np.ndarray:
    """Force of a spring with a slider that begins 1 + `more` times as strong, stepped by hand."""
    stretched, slid, found = 0.0, 0.0, np.empty_like(x)
    for index, step in enumerate(np.diff(x, prepend=x[0])):
        slid += abs(step)
        limit = LIMIT * (1 + more * np.exp(-slid / PATH))
        stretched = float(np.clip(stretched + STIFFNESS * step, -limit, limit))
        found[index] = stretched
    return found


def test_a_slider_that_runs_in_is_offered_in_place_of_a_constant_one(tmp_path: Path) -> None:
    study = damper(tmp_path, settling)
    before = add(study, "jenkins", "load").after
    found = explain(open_study(study.folder)).exchange
    assert found is not None
    assert found.effect == "jenkins_running_in"
    undo(open_study(study.folder))
    after = add(open_study(study.folder), found.effect, found.port).after
    assert after.held_out_error < 0.6 * before.held_out_error
    values = {name.split("_")[-1]: v.value for name, v in after.parameters.items()}
    assert values["Fc"] == pytest.approx(LIMIT, rel=0.05)
    assert values["g"] == pytest.approx(MORE, rel=0.25)
    assert values["path"] == pytest.approx(PATH, rel=0.3)


@pytest.mark.nightly
def test_what_explains_a_little_of_an_unknown_rest_is_not_offered(tmp_path: Path) -> None:
    def disturbed(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        since = np.arange(len(x)) / 100
        return settling(x, v, 0.3) + 3 * np.sin(2 * since**2) * np.sin(0.7 * since)

    study = damper(tmp_path, disturbed)
    before = add(study, "jenkins", "load").after
    after = add(open_study(study.folder), "jenkins_running_in", "load", anyway=True).after
    assert after.held_out_error < 0.9 * before.held_out_error
    undo(open_study(study.folder))
    assert exchange(open_bench(open_study(study.folder)), no_progress) is None


def test_each_recording_runs_in_from_its_own_beginning(tmp_path: Path) -> None:
    def stroke(seed: int, samples: int) -> dict[str, np.ndarray]:
        t = np.arange(samples) / 100
        x = 0.03 * np.sin(2 * np.pi * (0.5 + 0.1 * seed) * t + seed)
        v = np.gradient(x, 0.01)
        noise = 0.2 * np.random.default_rng(seed).normal(size=samples)
        return {"x": x, "v": v, "force": 3 * v + settling(x, v) + noise}

    train, held_out = [stroke(0, 700), stroke(1, 500)], [stroke(2, 400), stroke(3, 600)]
    study = studied(tmp_path, DAMPER, train, held_out, UNITS)
    found = add(study, "jenkins_running_in", "load", anyway=True).after
    assert found.held_out_error < 1.5
    assert found.parameters["load_jenkins_running_in_g"].value == pytest.approx(MORE, rel=0.15)


def test_windows_begin_with_the_path_until_then_and_fit_nothing_of_it() -> None:
    placement = Placement("coulomb_running_in", library()["coulomb_running_in"], "load")
    compiled = compile_system(compose(MODEL, [placement]))
    values = compiled.vector({
        "m": 1.0, "c": 1.0, "k": 50.0, "load_coulomb_running_in_Fc": 0.5,
        "load_coulomb_running_in_g": 1.0, "load_coulomb_running_in_path": 0.5,
        "load_coulomb_running_in_vs": 1e-3,
    })  # fmt: skip
    column = list(compiled.system.states).index("load_coulomb_running_in_q")
    force = 5 * np.sin(2 * np.pi * 1.3 * np.arange(400) / 100)[:, None]
    run = compiled.simulate(
        force, 0.01, np.zeros(1, np.int64), 400, parameters=values, substeps=8,
        initial=np.zeros((1, len(compiled.system.states))),
    )  # fmt: skip
    twice = Recording(
        0.01, np.concatenate([force, force]), np.tile(run.outputs[0], (2, 1)), parts=(400, 400)
    )
    held = fit(compiled, twice, 100, start=values, substeps=8)
    begun = evaluate(held, twice, 100, 8, judging=True).initial[:, column]
    travelled = np.abs(np.diff(run.outputs[0, :, 0])).cumsum()
    expected = np.concatenate([[0.0], travelled[[100, 200, 300]]])
    assert begun == pytest.approx(np.tile(expected, 2), abs=0.03 * travelled[-1])
    assert begun[[0, 4]].tolist() == [0.0, 0.0]
