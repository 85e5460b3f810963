"""What a black box learns of a healthy rig: any motion, any order, any rounding."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.fit import term_selection
from rigwatch.workbench.fit.boundedness import BoundednessTest
from rigwatch.workbench.fit.learned_terms import LEARNED, with_products
from rigwatch.workbench.fit.term_selection import Learned, learn_terms
from rigwatch.workbench.fit.whole_fit import SHARE, fit_whole, search_scales
from rigwatch.workbench.study.study import Study
from tests.workbench.black_box import record, study

pytestmark = pytest.mark.long

HORIZON = 512
Case = tuple[Study, Recording]
Taught = Callable[[int], Learned]
TOGETHER = ("products of three", "products of two")


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Case]:
    """The black box along the motion of a healthy rig, by the seed of its excitation and noise."""

    @cache
    def made(seed: int) -> Case:
        folder: Path = tmp_path_factory.mktemp(f"seed{seed}")
        record(folder, "healthy", seed, seed, period=1000 + seed)
        record(folder, "rig", seed + 10, seed + 1, period=1001 + seed)
        opened = study(folder)
        along, data = along_motion(opened, prepare(opened))
        assert data.healthy is not None
        return along, data.healthy

    return made


@pytest.fixture(scope="module")
def taught(healthy: Callable[[int], Case]) -> Taught:
    """What the terms learn, by the same seed."""
    return cache(lambda seed: learn_terms(*healthy(seed), HORIZON))


@pytest.fixture(scope="module")
def bare(healthy: Callable[[int], Case]) -> Taught:
    """The same without terms."""

    @cache
    def made(seed: int) -> Learned:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(term_selection, "TERMS", {})
            return learn_terms(*healthy(seed), HORIZON)

    return made


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [2, 3, 6])
def test_products_are_learned_from_any_excitation(taught: Taught, bare: Taught, seed: int) -> None:
    found = taught(seed)

    assert set(found.steps) >= set(TOGETHER)
    assert found.fitted.convergence is not None
    assert found.fitted.convergence.converged
    assert found.fitted.train_error < 0.5 * bare(seed).fitted.train_error


@pytest.mark.nightly
def test_what_is_learned_does_not_hinge_on_the_last_digits(
    healthy: Callable[[int], Case], taught: Taught
) -> None:
    opened, recording = healthy(2)
    last = 1 + 1e-12 * np.random.default_rng(0).standard_normal(recording.outputs.shape)

    found = learn_terms(opened, replace(recording, outputs=recording.outputs * last), HORIZON)

    assert found.steps == taught(2).steps
    assert found.fitted.train_error == pytest.approx(taught(2).fitted.train_error, rel=1e-3)


@pytest.mark.nightly
def test_the_order_of_terms_makes_no_difference(
    healthy: Callable[[int], Case], taught: Taught, monkeypatch: pytest.MonkeyPatch
) -> None:
    backwards = dict(reversed(term_selection.TERMS.items()))
    monkeypatch.setattr(term_selection, "TERMS", backwards)

    found = learn_terms(*healthy(2), HORIZON)

    assert set(found.steps) == set(taught(2).steps)
    assert found.fitted.train_error == pytest.approx(taught(2).fitted.train_error, rel=0.03)


@pytest.mark.nightly
def test_a_fit_that_begins_blown_up_ends_as_one_that_is_not(
    healthy: Callable[[int], Case], taught: Taught, bare: Taught
) -> None:
    opened, recording = healthy(2)
    data = term_selection._split(recording, HORIZON)
    start = taught(2).fitted.train.values() | {f"{LEARNED}push_push_push": 1e4}

    found = fit_whole(opened, taught(2).model, data, start)

    assert found.train_error < bare(2).fitted.train_error


@pytest.mark.nightly
def test_a_model_with_equilibria_that_nobody_has_seen_does_not_stay(
    healthy: Callable[[int], Case], taught: Taught, bare: Taught
) -> None:
    _, recording = healthy(2)
    test = BoundednessTest(bare(2).fitted, recording)
    assert test.passes(taught(2).fitted)
    compiled = taught(2).fitted.compiled
    values = taught(2).fitted.train.values() | {f"{LEARNED}push_push_push": 1e5}
    pushed = replace(taught(2).fitted.train, parameters=compiled.vector(values))

    assert not test.passes(replace(taught(2).fitted, train=pushed))


def test_coefficients_move_the_output_alike_whatever_their_units(
    healthy: Callable[[int], Case], bare: Taught
) -> None:
    _, recording = healthy(2)
    fitted = bare(2).fitted
    sizes = BoundednessTest(fitted, recording).sizes
    larger = with_products(fitted.compiled.system.model, sizes, 2)
    compiled = compile_system(compose(larger))
    at = compiled.vector(fitted.train.values())
    moved = search_scales(compiled, recording, at, 4)
    size = np.nanstd(recording.outputs)
    states = len(compiled.system.states)

    def simulated(parameters: np.ndarray) -> np.ndarray:
        return compiled.simulate(
            recording.inputs, recording.dt, np.zeros(1, np.int64), len(recording),
            initial=np.zeros((1, states)), parameters=parameters, substeps=4,
        ).outputs[0]  # fmt: skip

    names = list(compiled.system.parameters)
    for name, unit in zip(compiled.system.free, moved.tolist(), strict=True):
        if name.startswith(LEARNED):
            beside = at.copy()
            beside[names.index(name)] += 1e-4 * unit
            change = np.sqrt(np.mean((simulated(beside) - simulated(at)) ** 2))
            assert change == pytest.approx(1e-4 * SHARE * size, rel=0.02)
