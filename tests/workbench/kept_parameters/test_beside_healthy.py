"""Where a healthy recording leaves the model open, the training beside it tells what is missing.

Two frequencies give four equations for the five parameters of the model: at the point at which the
healthy recording keeps them even the right effect leaves a part of the error.
"""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.compare import Bench, locate, may_share, open_bench, shared_bench
from rigwatch.workbench.explain.explain import _explained_once, explained
from rigwatch.workbench.explain.explanation import Explanation
from rigwatch.workbench.ranking import no_progress
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import Table, studied, with_healthy
from tests.workbench.simulated import with_few_effects

MODEL = """
name = "slide"
summary = "A mass on a spring that a slow motor pushes; position and acceleration are measured."
inputs.u = { unit = "N", hold = "zero" }
quantities.acceleration = { expression = "(q - c*v - k*x + load)/m", unit = "m/s^2" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "acceleration", rate_of = "position" }
states.q = { unit = "N", derivative = "w*(r - q)" }
states.r = { unit = "N", derivative = "wr*(g*drive - r)" }
parameters.m = { value = 1.0, unit = "kg", fixed = true }
parameters.k = { value = 50.0, unit = "N/m", low = 0.0, high = 1000.0, kept = true }
parameters.c = { value = 5.0, unit = "N s/m", low = 0.0, high = 100.0, kept = true }
parameters.g = { value = 1.0, unit = "1", low = 0.1, high = 10.0, kept = true }
parameters.w = { value = 40.0, unit = "1/s", low = 2.0, high = 500.0, kept = true }
parameters.wr = { value = 150.0, unit = "1/s", low = 2.0, high = 500.0, kept = true }
outputs.position = { unit = "m", expression = "x" }
outputs.acceleration = { unit = "m/s^2", expression = "acceleration" }
ports.drive = { kind = "actuator", signal = "u" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"u": "N", "position": "m", "acceleration": "m/s^2"}
RATE, SECONDS, SETTLED, STEPS = 256.0, 16.0, 4.0, 16
APART, CLOSE = (3.0, 6.0), (4.0, 4.25)
"""Frequencies of the drive [Hz]."""
NOISE = (2e-5, 0.13)
"""Standard deviations of noise: of position [m], of acceleration [m/s^2]."""


@kernel(allocates=True)
def moved(u: np.ndarray, stiffer: float, weaker: float) -> np.ndarray:
    """Position and acceleration at each sample."""
    read = np.zeros((u.size, 2))
    x = v = q = r = 0.0
    h = 1.0 / (RATE * STEPS)
    for n in range(u.size):
        for j in range(STEPS):
            a = q - 2.0 * v - (100.0 + stiffer) * x
            if j == 0:
                read[n] = x, a
            v += h * a
            x += h * v
            q += h * 60.0 * (r - q)
            r += h * 90.0 * (1.2 * (1.0 - weaker) * u[n] - r)
    return read


def run(
    seed: int,
    lines: tuple[float, float] = APART,
    stiffer: float = 0.0,
    weaker: float = 0.0,
    louder: float = 1.0,
) -> Table:
    """A log of the machine in steady motion, with noise that may be louder than usual."""
    time = np.arange(round((SETTLED + SECONDS) * RATE)) / RATE
    u = 10.0 * np.sum(np.cos(2 * np.pi * np.outer(time, lines) + (0.5, 1.5)), axis=1)
    read = moved(u, stiffer, weaker)
    read += np.random.default_rng(seed).normal(size=read.shape) * NOISE * louder
    steady = slice(round(SETTLED * RATE), None)
    return {"u": u[steady], "position": read[steady, 0], "acceleration": read[steady, 1]}


def bench(
    folder: Path, lines: tuple[float, float] = APART, ports: str = "", **hidden: float
) -> Bench:
    """A study of the machine with something hidden in it, and of the healthy one, fitted.

    `ports` are further ones of the model.
    """
    train, held_out = (run(seed, lines, **hidden) for seed in (1, 2))
    made = studied(folder, MODEL + ports, [train], [held_out], UNITS, rates=[RATE, RATE])
    return with_few_effects(open_bench(with_healthy(made, run(3, lines), UNITS, RATE)))


def named(found: Explanation) -> str:
    """The effect that a verdict names; empty if it names none."""
    best = found.ranking[0]
    return f"{best.effect}@{best.port}" if found.verdict == "missing_effect" else ""


def test_a_strength_is_right_although_the_healthy_recording_leaves_the_model_open(
    tmp_path: Path,
) -> None:
    made = bench(tmp_path, stiffer=60.0)
    assert made.study.model.parameters["k"].value < 90.0, "the machine has 100 N/m"

    found = explained(made).explanation

    assert named(found) == "linear_stiffness@load", found.text
    k = found.ranking[0].parameters["k"]
    assert k.value == pytest.approx(60.0, rel=0.02)
    low, high = k.interval
    assert 55.0 < low < 60.0 < high < 65.0
    assert "with the healthy recording in the training to 0.131 m/s^2" in found.text


@pytest.mark.nightly
def test_what_makes_the_healthy_recording_its_own_is_no_rival(tmp_path: Path) -> None:
    made = bench(tmp_path, lines=CLOSE, weaker=0.08, louder=1.12)
    alone = _explained_once(made, no_progress).explanation
    assert (alone.verdict, alone.rivals) == ("undetermined", ["linear_stiffness@load"]), alone.text

    found = explained(made).explanation

    assert named(found) == "gain@drive", found.text
    g = found.ranking[0].parameters["g"]
    assert g.value == pytest.approx(0.92, rel=0.01)
    refused = next(row for row in found.ranking if row.effect == "linear_stiffness")
    assert refused.reason == "the healthy recording is no longer described with it"
    assert any("healthy recording alone leaves open" in said for said in found.comparison.remarks)
    own = made.base.held_out_error
    assert found.comparison.held_out_error == own, "the study's own comparison remains"


def test_two_effects_of_which_none_is_accepted_alone_are_told_with_doubt(tmp_path: Path) -> None:
    made = bench(tmp_path, stiffer=60.0, weaker=0.08)
    alone = _explained_once(made, no_progress).explanation
    assert (alone.verdict, alone.also) == ("undetermined", []), alone.text

    found = explained(made).explanation

    assert found.verdict == "undetermined", found.text
    best = found.ranking[0]
    assert (f"{best.effect}@{best.port}", found.also) == ("linear_stiffness@load", ["gain@drive"])
    assert found.text.startswith("likely, not certain: linear_stiffness@load is missing, and gain@")


@pytest.mark.parametrize("weaker", [-0.08, 0.08])
def test_a_motor_that_changed_is_not_called_a_spring(tmp_path: Path, weaker: float) -> None:
    found = explained(bench(tmp_path, lines=CLOSE, weaker=weaker)).explanation
    assert named(found) in {"", "gain@drive"}


def test_nothing_is_missing_where_nothing_is_hidden(tmp_path: Path) -> None:
    assert explained(bench(tmp_path)).explanation.verdict == "nothing_missing"


def test_the_training_holds_both_recordings_and_what_is_held_out_stays(tmp_path: Path) -> None:
    made = bench(tmp_path, stiffer=60.0)
    both = shared_bench(made)
    assert both is not None
    assert both.data.train.parts == (len(made.data.train), len(made.data.healthy))
    assert np.array_equal(both.data.held_out.outputs, made.data.held_out.outputs, equal_nan=True)
    assert set(both.base.compiled.system.free) == {"k", "c", "g", "w", "wr"}


def test_a_study_without_a_healthy_recording_is_left_as_it_is(tmp_path: Path) -> None:
    tables = [run(seed, stiffer=60.0) for seed in (1, 2)]
    made = studied(tmp_path, MODEL, tables[:1], tables[1:], UNITS, rates=[RATE, RATE])
    alone = open_bench(made)
    assert not may_share(alone.study, alone.data)


def test_the_effect_is_added_as_it_was_named_and_then_nothing_is_missing(tmp_path: Path) -> None:
    study = bench(tmp_path, stiffer=60.0).study.folder

    change = add(open_study(study), "linear_stiffness", "load")

    assert change.step == "add", change.text
    k = change.after.parameters["load_linear_stiffness_k"]
    assert k.value == pytest.approx(60.0, rel=0.02)
    assert change.after.held_out_error < 1.1 * change.after.noise_floor
    again = open_bench(open_study(study))
    assert again.base.train.values()["k"] == pytest.approx(100.0, rel=0.02)
    assert explained(with_few_effects(again)).explanation.verdict == "nothing_missing"
    times = {region.name.split(",")[0] for region in locate(again) if region.view == "time"}
    assert times == {"../train0.mcap", "../healthy.mcap"}


def test_an_effect_that_makes_the_healthy_recording_its_own_is_not_added_so(tmp_path: Path) -> None:
    study = open_study(bench(tmp_path, stiffer=60.0).study.folder)
    change = add(study, "gain", "drive", anyway=True)
    assert change.tried[1] > 1.5 * change.after.noise_floor
    assert not open_study(study.folder).file.effects[0].model
