"""A black box along the measured motion learns what a healthy rig does, and no period of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.measured_motion import along_measured_motion
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import compose
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.preparation import bench_of, determined_by_healthy, open_bench
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import Data, prepare
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit import term_selection
from rigwatch.workbench.fit.learned_terms import LEARNED, with_friction, with_products
from rigwatch.workbench.study.study import Study
from tests.workbench.black_box import TEMPLATE, study
from tests.workbench.black_box import record as multisine
from tests.workbench.simulated import COMMON, knowing

pytestmark = pytest.mark.long

SIZES = {
    "load": {"x": 0.01, "v": 0.3},
    "remainder": {"push": 3.0, "flow": 0.3, "speed": 0.3, "place": 0.01},
}


def record(folder: Path, name: str, noise: int, phases: int, **effects: float) -> None:
    """Excitations of which neither the phases nor the periods are the same."""
    multisine(folder, name, noise, phases, period=1000 + phases, **effects)


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Data, FloatArray | None]:
    """What the healthy recording teaches, which is the same beside every other one."""
    opened = recorded(tmp_path_factory.mktemp("taught"))
    return determined_by_healthy(opened, prepare(opened))


def recorded(folder: Path, **effects: float) -> Study:
    """A healthy rig, and one with effects under an excitation that was not learned."""
    record(folder, "healthy", 1, phases=1)
    record(folder, "rig", 2, phases=2, **effects)
    return study(folder)


@pytest.mark.nightly
def test_what_is_learned_holds_under_an_excitation_that_was_not_learned(
    tmp_path: Path,
    taught: tuple[Study, Data, FloatArray | None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = bench_of(*taught)
    monkeypatch.setattr(term_selection, "TERMS", {})
    bare = open_bench(recorded(tmp_path))
    assert found.floor.rms[0] < bare.floor.rms[0]
    assert found.base.held_out_error < bare.base.held_out_error
    assert ranking(found)[1].word != "missing_effect"


@pytest.mark.nightly
def test_friction_is_named_in_newtons_under_an_excitation_that_was_not_learned(
    tmp_path: Path, taught: tuple[Study, Data, FloatArray | None]
) -> None:
    opened = recorded(tmp_path, coulomb=0.5)
    _, driven = along_motion(opened, prepare(opened))
    of, data, scale = taught
    bench = bench_of(knowing(of, *COMMON), replace(driven, horizon=data.horizon), scale)
    rows, verdict = ranking(bench)
    assert verdict.word == "missing_effect"
    best = next(row for row in rows if row.label == "coulomb@load")
    assert best.label in verdict.members
    assert best.fitted is not None
    assert best.fitted.train.values()["load_coulomb_Fc"] == pytest.approx(0.5, rel=0.2)


def test_without_a_healthy_recording_it_says_what_is_needed(tmp_path: Path) -> None:
    record(tmp_path, "healthy", 1, phases=1)
    record(tmp_path, "rig", 2, phases=2)
    with pytest.raises(ModelError, match="found no healthy recording"):
        open_bench(study(tmp_path, TEMPLATE.read_text(encoding="utf-8").split("[[healthy]]")[0]))


def test_products_leave_hidden_states_bounded_whatever_their_coefficients() -> None:
    model = with_products(along_measured_motion(shipped_models()["fourth-order"]), SIZES, 3)
    compiled = compile_system(compose(model))
    start = compiled.vector({f"{LEARNED}push_push_push": 1e4})
    inputs = 0.01 * np.sin(np.arange(2000))[:, None] * np.ones(3)
    run = compiled.simulate(
        inputs, 1 / 256, np.zeros(1, np.int64), 2000, initial=np.full((1, 4), 10.0),
        parameters=start, substeps=4,
    )  # fmt: skip
    assert np.isfinite(run.last).all()
    assert abs(run.last).max() < 1e5


def test_products_that_stand_already_are_not_added_again() -> None:
    model = along_measured_motion(shipped_models()["fourth-order"])
    some = with_products(model, SIZES, 3, without=("flow",))
    every = with_products(some, SIZES, 3)
    counts = [sum(n.startswith(LEARNED) and p.kept for n, p in m.parameters.items())
              for m in (some, every)]  # fmt: skip
    assert counts == [10, 20]


def test_terms_vanish_at_the_start_of_a_fit() -> None:
    model = along_measured_motion(shipped_models()["fourth-order"])
    larger = with_products(with_friction(model, SIZES), SIZES, 3)
    inputs = np.random.default_rng(1).normal(size=(500, 3)) * [1.0, 0.01, 0.3]
    runs = [
        compile_system(compose(m)).simulate(
            inputs, 1 / 256, np.zeros(1, np.int64), 500, initial=np.zeros((1, 4)),
            parameters=compile_system(compose(m)).parameters, substeps=4,
        ).outputs
        for m in (model, larger)
    ]  # fmt: skip
    assert runs[0] == pytest.approx(runs[1], abs=1e-9)


def test_a_model_without_the_port_learns_no_products() -> None:
    model = shipped_models()["mass-spring-damper"]
    assert with_products(model, SIZES, 3) is model
