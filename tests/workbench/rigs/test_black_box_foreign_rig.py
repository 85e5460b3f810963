"""The black box on a rig that nobody here built: what is hidden in it, and what cannot be said."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, bench_of, determined_by_healthy
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.rough_verdict import MOTION_ALLOWANCE, limited_verdict
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tests.workbench.conftest import measured

pytestmark = pytest.mark.long

RATE = 256
SETTLED, HALF = 8 * RATE, 24 * RATE


def recorded(case: str, begin: int, end: int | None = None) -> Recording:
    """A part of a recording [samples]."""
    table = np.loadtxt(measured("foreign_rig", "explain", f"{case}.csv"), delimiter=",", skiprows=1)
    rows = table[begin:end]
    return Recording(1 / RATE, rows[:, 1:2], rows[:, 2:], parts=(len(rows),))


def opened(case: str) -> tuple[Study, Data]:
    """The black box, and a healthy recording beside one with something hidden."""
    span = (Span(session="recorded"),)
    file = StudyFile(model="fourth-order", train=span, held_out=span)
    study = Study(Path(), file, shipped_models()["fourth-order"], library(), frozenset())
    data = Data(
        recorded(case, SETTLED, HALF), recorded(case, HALF), recorded("healthy", SETTLED),
        RATE // 2, (),
    )  # fmt: skip
    return study, data


@cache
def taught() -> tuple[Study, Data, FloatArray | None]:
    """What the healthy recording teaches, which is the same beside every other one."""
    return determined_by_healthy(*opened("none"))


def bench(case: str) -> Bench:
    """The black box that the healthy recording has taught, beside one with something hidden."""
    study, data, scale = taught()
    _, driven = along_motion(*opened(case))
    return bench_of(study, replace(driven, horizon=data.horizon), scale)


@pytest.mark.nightly
def test_nothing_is_missing_where_nothing_is_hidden() -> None:
    found = bench("none")

    assert found.base.held_out_error == pytest.approx(found.floor.rms[0], rel=0.05)
    assert ranking(found)[1].word == "nothing_missing"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("case", "named"),
    [("deadband", "dead_band@drive"), ("coulomb_other_excitation", "coulomb@load")],
)
def test_what_is_hidden_is_named_under_any_excitation(case: str, named: str) -> None:
    _, verdict = ranking(bench(case))

    assert verdict.word == "missing_effect"
    assert named in verdict.members


@pytest.mark.nightly
def test_what_another_motion_may_leave_is_not_named() -> None:
    found = bench("pressure")

    rows, verdict = ranking(found)

    assert found.floor.ratio(found.base.held_out) < MOTION_ALLOWANCE
    assert verdict.word != "missing_effect"
    assert limited_verdict(found.base, rows, found.floor, verdict).word != "missing_effect"
