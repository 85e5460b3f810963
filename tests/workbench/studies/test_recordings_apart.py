"""What an effect remembers of one recording is forgotten at the beginning of the next."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.explain import explain
from rigwatch.workbench.ranking.candidates import candidates
from rigwatch.workbench.ranking.scoring import rank_only
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Accepted, Span
from tests.workbench.machine import studied

DAMPER = """
name = "damper"
summary = "Force of a damper of which displacement and speed are known."
inputs.x = { unit = "m" }
inputs.v = { unit = "m/s" }
parameters.c = { value = 1.0, unit = "N*s/m" }
outputs.force = { unit = "N", expression = "c*v - load" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"x": "m", "v": "m/s", "force": "N"}
BRUSH = [Accepted(effect="jenkins", port="load")]


def stroke(seed: int, samples: int, first: float) -> dict[str, np.ndarray]:
    """A spring in series with a slider, integrated here; it begins bent."""
    t = np.arange(samples) / 100
    x = 0.02 * np.sin(2 * np.pi * (0.4 + 0.1 * seed) * t + seed) + first * t
    z, force = (-1.0) ** seed * 20.0, np.empty(samples)
    for i, step in enumerate(np.diff(x, prepend=x[0])):
        z = float(np.clip(z + 5000.0 * step, -20.0, 20.0))
        force[i] = z
    v = np.gradient(x, 0.01)
    noise = np.random.default_rng(seed).normal(size=samples)
    return {"x": x, "v": v, "force": 3 * v + force + 0.2 * noise}


TRAIN = [stroke(0, 700, 0.0), stroke(1, 500, 0.01)]
HELD = [stroke(2, 400, 0.0), stroke(3, 650, 0.02), stroke(4, 300, -0.01)]


def opened(folder: Path, train: list, held_out: list, keys: str = "") -> Bench:
    study = studied(folder, DAMPER, train, held_out, UNITS, keys)
    return open_bench(study.with_effects(BRUSH))


def test_the_held_out_error_does_not_depend_on_the_recordings_order(tmp_path: Path) -> None:
    one = opened(tmp_path / "a", TRAIN, HELD)
    other = opened(tmp_path / "b", TRAIN, HELD[::-1])
    assert other.base.held_out_error == pytest.approx(one.base.held_out_error, rel=1e-9)
    assert one.base.held_out_error < 0.4


def test_each_recording_counts_as_it_does_alone(tmp_path: Path) -> None:
    together = opened(tmp_path / "a", TRAIN, HELD)
    squared = np.split(together.base.held_out.residuals[0, :, 0] ** 2, [400, 1050])
    for index, piece in enumerate(squared):
        alone = opened(tmp_path / f"{index}", TRAIN, HELD[index : index + 1])
        assert np.sqrt(np.nanmean(piece)) == pytest.approx(alone.base.held_out_error, rel=1e-9)


def test_so_it_is_where_residuals_are_thinned(tmp_path: Path) -> None:
    thin = "thin = { factor = 4, edge = 2 }"
    one = opened(tmp_path / "a", TRAIN, HELD, thin)
    other = opened(tmp_path / "b", TRAIN, HELD[::-1], thin)
    assert other.base.held_out_error == pytest.approx(one.base.held_out_error, rel=1e-9)


def test_the_score_begins_each_recording_anew(tmp_path: Path) -> None:
    study = studied(tmp_path / "a", DAMPER, TRAIN, HELD, UNITS)
    turned = studied(tmp_path / "b", DAMPER, TRAIN[::-1], HELD, UNITS)
    explained = [_explained(open_bench(each)) for each in (study, turned)]
    assert explained[0] == pytest.approx(explained[1], rel=1e-6)


def _explained(bench: Bench) -> float:
    found = [c for c in candidates(bench.study, bench.data.train) if c.name == "jenkins"]
    return rank_only(bench.study, bench.data, bench.base, found).explained


def late(seed: int, lag: float) -> dict[str, np.ndarray]:
    """A damper whose load cell follows its force with a lag [s]."""
    t = np.arange(12_000) / 1000
    phases = np.random.default_rng(seed).uniform(0, 6, 4)
    rates = 2 * np.pi * np.array([0.4, 1.1, 2.3, 4.1])
    v = (0.02 * np.sqrt(rates) * np.cos(np.outer(t, rates) + phases)).sum(axis=1)
    x, told = np.cumsum(v) / 1000, np.zeros(len(t))
    for i in range(1, len(t)):
        told[i] = told[i - 1] + (3.0 * v[i - 1] + 40.0 * x[i - 1] - told[i - 1]) * 1e-3 / lag
    noise = 0.01 * np.random.default_rng(seed + 9).standard_normal(1200)
    return {"x": x[::10], "v": v[::10], "force": told[::10] + noise}


@pytest.mark.parametrize("lag", [0.02, 0.8])
def test_a_load_cell_that_is_late_is_named_beside_a_model_without_states(
    tmp_path: Path, lag: float
) -> None:
    cell = DAMPER.replace("c*v - load", "c*v + k*x - load").replace(
        'N*s/m" }', 'N*s/m" }\nparameters.k = { value = 20.0, unit = "N/m" }'
    )
    cell += '[ports.cell]\nkind = "sensor"\nsignal = "force"\n'
    study = studied(tmp_path, cell, [late(1, lag), late(2, lag)], [late(3, lag)], UNITS)

    found = explain(study)

    assert found.verdict == "missing_effect"
    best = found.ranking[0]
    assert "lag@cell" in {f"{best.effect}@{best.port}", *best.class_}
    late_by = next(row for row in found.ranking if row.effect == "lag").parameters["tau"].value
    assert late_by == pytest.approx(lag, rel=0.05)


LOAD_CELL = DAMPER + '[ports.cell]\nkind = "sensor"\nsignal = "force"\n'
MASS = """
name = "mass"
summary = "A mass on a damper."
inputs.push = { unit = "N", hold = "zero" }
parameters.m = { value = 2.0, unit = "kg", low = 0.1, high = 10.0 }
parameters.c = { value = 5.0, unit = "N*s/m", low = 0.1, high = 50.0 }
states.v = { unit = "m/s", derivative = "(push - c*v)/m", measured = "speed" }
outputs.speed = { unit = "m/s", expression = "v" }
ports.cell = { kind = "sensor", signal = "speed" }
"""
DRIFT = 0.05
"""What the sensor gains [units of its signal/s], over a signal of about 1."""


def drifting(seed: int, seconds: float, *, inertia: bool) -> dict[str, np.ndarray]:
    """A damper, or a mass on one, whose sensor drifts from zero since the log's beginning."""
    t = np.arange(round(seconds * 100)) / 100
    random = np.random.default_rng(seed)
    push = np.cumsum(random.normal(size=len(t)))
    push -= np.convolve(push, np.ones(101) / 101, "same")
    shown = DRIFT * t + 1e-3 * random.normal(size=len(t))
    if not inertia:
        return {"x": 0 * t, "v": push, "force": 3 * push + shown}
    share = 1 - np.exp(-5.0 / 2.0 / 100)
    v = np.zeros(len(t))
    for k in range(1, len(t)):
        v[k] = v[k - 1] + share * (push[k - 1] / 5.0 - v[k - 1])
    return {"push": push, "speed": v + shown}


def drifted(folder: Path, *, inertia: bool) -> Study:
    """Its study, of several logs, with the drift accepted."""
    logs = [drifting(seed, 8.0 + seed, inertia=inertia) for seed in range(4)]
    model, units = (MASS, {"push": "N", "speed": "m/s"}) if inertia else (LOAD_CELL, UNITS)
    keys = "horizon = 1.0" if inertia else ""
    study = studied(folder, model, logs[:3], logs[3:], units, keys)
    return study.with_effects([Accepted(effect="drift", port="cell")])


@pytest.mark.parametrize("inertia", [False, True], ids=["without states", "with states"])
def test_a_sensor_drifts_from_the_beginning_of_each_recording(
    tmp_path: Path, *, inertia: bool
) -> None:
    bench = open_bench(drifted(tmp_path, inertia=inertia))
    assert bench.base.train.values()["cell_drift_r"] == pytest.approx(DRIFT, rel=0.02)
    assert bench.base.held_out_error < 1.5e-3


@pytest.mark.parametrize("inertia", [False, True], ids=["without states", "with states"])
def test_it_goes_on_drifting_in_a_held_out_part_of_the_same_recording(
    tmp_path: Path, *, inertia: bool
) -> None:
    study = drifted(tmp_path, inertia=inertia)
    name = study.file.held_out[0].session
    halves = (Span(session=name, end=6.0),), (Span(session=name, start=6.0),)
    parts = structs.replace(study.file, train=halves[0], held_out=halves[1])
    bench = open_bench(replace(study, file=parts))
    assert bench.base.held_out_error < 1.5e-3
