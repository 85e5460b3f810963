"""A rig that nobody here built: its healthy fit, what is hidden in it, and when nobody can say."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import Bench, bench_of, determined_by_healthy
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.noise.noise_floor import from_residual, quiet_scale
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tests.workbench.conftest import measured

pytestmark = pytest.mark.long

RATE = 256
SETTLED, HALF = 8 * RATE, 24 * RATE


@cache
def recorded(case: str) -> Recording:
    """A recording from its second period on."""
    path = measured("foreign_rig", "explain", f"{case}.csv")
    time, *signals = np.loadtxt(path, delimiter=",", skiprows=1).T
    columns = np.stack(signals, axis=1)
    return Recording(float(np.median(np.diff(time))), columns[:, :1], columns[:, 1:])


def part(whole: Recording, begin: int, end: int | None = None) -> Recording:
    return Recording(whole.dt, whole.inputs[begin:end], whole.outputs[begin:end])


def opened(case: str, healthy: Recording | None = None) -> tuple[Study, Data]:
    """The analytic model, and a healthy recording beside one with something hidden."""
    span = (Span(session="recorded"),)
    file = StudyFile(model="servo-pneumatic", train=span, held_out=span)
    study = Study(Path(), file, shipped_models()["servo-pneumatic"], library(), frozenset())
    whole, known = recorded(case), healthy or part(recorded("healthy"), SETTLED)
    return study, Data(part(whole, SETTLED, HALF), part(whole, HALF), known, RATE // 2, ())


@cache
def told() -> Study:
    """What the healthy recording tells of the model, which is the same beside every other one."""
    return determined_by_healthy(*opened("none"))[0]


def bench(case: str) -> Bench:
    """The analytic model told by the healthy recording, beside one with something hidden."""
    _, data = along_motion(*opened(case))
    return bench_of(told(), data, quiet_scale(data.train))


@pytest.mark.nightly
def test_healthy_fit_comes_near_to_what_repeated_periods_allow() -> None:
    found = bench("none")

    healthy = found.data.of_healthy
    assert healthy is not None
    assert found.bare is not None
    noise = from_residual(found.bare.train, healthy.train, 0.0, healthy.horizon)
    assert noise.method == "periods"
    assert noise.ratio(found.bare.train) < 1.5
    assert ranking(found)[1].word == "nothing_missing"


@pytest.mark.parametrize(
    ("case", "named", "parameter", "truth"),
    [
        pytest.param("spring", "linear_stiffness@load", "k", None, marks=pytest.mark.nightly),
        ("deadband", "dead_band@drive", "b", 0.03),
        pytest.param("saturation", "saturation@drive", "us", 0.5, marks=pytest.mark.nightly),
        pytest.param("coulomb_strong", "coulomb@load", "Fc", None, marks=pytest.mark.nightly),
    ],
)
def test_what_is_hidden_is_named(
    case: str, named: str, parameter: str, truth: float | None
) -> None:
    _, verdict = ranking(bench(case))

    assert verdict.word == "missing_effect"
    assert verdict.best is not None
    assert verdict.best.label == named
    assert verdict.best.fitted is not None
    value = verdict.best.fitted.train.values()[verdict.best.placement.prefix + parameter]
    assert truth is None or value == pytest.approx(truth, rel=0.05)


@pytest.mark.nightly
def test_model_that_does_not_describe_the_healthy_rig_names_nothing() -> None:
    healthy = part(recorded("healthy"), SETTLED)
    other = replace(healthy, outputs=healthy.outputs * [1.0, -1.0])

    rows, verdict = ranking(bench_of(*determined_by_healthy(*opened("coulomb_strong", other))))

    assert verdict.word == "model_inadequate"
    assert verdict.best is None
    assert "healthy recording" in verdict.text
    assert rows
    assert all(row.fitted is None for row in rows)
