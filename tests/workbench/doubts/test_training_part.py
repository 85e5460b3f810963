"""The part of long recordings on which sets of effects and delays of inputs are tried."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigwatch.physics.engine.fit import evaluate
from rigwatch.workbench.compare import Bench, open_bench
from rigwatch.workbench.data import Data
from rigwatch.workbench.explain.sets.part_trial import tried
from rigwatch.workbench.fit import Fitted, TrainingPart, fit_model, part_of
from rigwatch.workbench.fit.input_hold import hold_trials
from rigwatch.workbench.fit.training.training_part import STRETCH, _stretches
from rigwatch.workbench.ranking import candidates, refit, scored
from rigwatch.workbench.study import Study
from tests.workbench.machine import Table, studied

ROTOR = """
name = "rotor"
summary = "Speed of a rotor from the torque at its shaft."
hold = "zero"
inputs.torque = { unit = "N m" }
states.w = { unit = "rad/s", derivative = "(torque - b*w + shaft)/J", measured = "speed" }
parameters.J = { value = 0.02, unit = "kg m^2", low = 1e-6 }
parameters.b = { value = 0.01, unit = "N m s/rad", low = 0.0 }
outputs.speed = { unit = "rad/s", expression = "w" }
ports.shaft = { kind = "force", unit = "N m", variables.v = { expression = "w", unit = "rad/s" } }
"""
UNSEEN = ROTOR.replace("(torque", "(coupling").replace(
    'parameters.b', 'states.coupling = { unit = "N m", derivative = "(torque - coupling)/tau" }\n'
    'parameters.tau = { value = 0.2, unit = "s", low = 0.02 }\nparameters.b'
)  # fmt: skip
"""Its torque comes through a coupling whose own torque no channel shows."""
UNITS = {"torque": "N m", "speed": "rad/s"}
OPEN = ROTOR.replace('hold = "zero"\n', "")
"""What its torque does between samples is chosen from the recordings."""
J, B, COULOMB, DT, FINER = 0.03, 0.02, 0.05, 0.01, 20


def log(
    seconds: float,
    seed: int,
    tau: float = 0.0,
    *,
    late: float = 0.0,
    coulomb: float = COULOMB,
    steady: int = 25,
) -> Table:
    """A rotor with Coulomb friction that stops it exactly, in small Euler steps.

    Each torque is kept for some samples, and acts from a part `late` of the first on.
    """
    generator = np.random.default_rng(seed)
    count = round(seconds / DT)
    torque = np.repeat(generator.uniform(-0.4, 0.4, count // steady + 1), steady)[:count]
    speed, w, driven = np.empty(count), 0.0, 0.0
    for k in range(count):
        speed[k] = w
        for step in range(FINER):
            acting = torque[max(k - 1, 0)] if step < late * FINER else torque[k]
            driven += DT / FINER * (acting - driven) / tau if tau else acting - driven
            free = w + DT / FINER * (driven - B * w) / J
            w = np.sign(free) * max(abs(free) - DT / FINER * coulomb / J, 0.0)
    return {"torque": torque, "speed": speed + 0.01 * generator.standard_normal(count)}


def opened(folder: Path, *seconds: float) -> Bench:
    train = [log(length, seed) for seed, length in enumerate(seconds)]
    return open_bench(studied(folder, ROTOR, train, [log(20, 9)], UNITS, "horizon = 0.5"))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return opened(tmp_path_factory.mktemp("rotor"), 60, 25, 10)


@pytest.fixture(scope="module")
def part(bench: Bench) -> TrainingPart:
    found = part_of(bench.study, bench.data)
    assert found is not None
    return found


@pytest.mark.parametrize("counts", [[400], [120, 50, 20], [15] * 12, [1, 64, 7]])
@pytest.mark.parametrize("factor", [2, 3, 5])
def test_stretches_take_a_share_of_every_recording(counts: list[int], factor: int) -> None:
    found = list(_stretches(counts, factor))
    begins = np.cumsum([0, *counts])
    for begin, end in pairwise(begins):
        own = [(at, size) for at, size in found if begin <= at < end]
        assert all(at + size <= end and 1 <= size <= STRETCH for at, size in own)
        taken = sum(size for _, size in own)
        assert (end - begin) / factor <= taken <= (end - begin) / factor + len(own)
    assert all(one + size <= other for (one, size), (other, _) in pairwise(found))


def test_short_recordings_are_used_whole(tmp_path: Path) -> None:
    bench = opened(tmp_path, 20)
    assert part_of(bench.study, bench.data) is None


def test_a_fit_on_the_part_is_what_a_simulation_of_the_part_gives(
    bench: Bench, part: TrainingPart
) -> None:
    base, train = bench.base, part.data.train
    assert len(train) < 0.6 * len(bench.data.train)
    own = part.of(base).train
    simulated = evaluate(base.train, train, base.horizon, base.substeps, own.initial)
    assert own.residuals.shape == simulated.residuals.shape
    np.testing.assert_allclose(own.residuals, simulated.residuals, atol=1e-3 * own.rms[0])


def test_an_effect_fits_the_part_as_it_does_the_whole(bench: Bench, part: TrainingPart) -> None:
    found = candidates(bench.study, bench.data.train)
    rows = scored(bench.study, part.data, part.of(bench.base), found)
    row = next(row for row in rows if row.effect == "coulomb")
    trial = tried(bench.study, part, bench.base, row)
    assert trial is not None
    refit(bench.study, bench.data, bench.base, row)
    assert row.fitted is not None
    assert trial.error == pytest.approx(row.fitted.train_error, rel=0.1)
    (starts,) = trial.starts.values()
    whole = row.fitted.train.values()
    assert starts == pytest.approx(whole, rel=0.05)
    assert starts[row.placement.prefix + "Fc"] == pytest.approx(COULOMB, rel=0.05)


@pytest.mark.nightly
def test_hidden_states_that_run_on_are_taken_on_the_part_as_well(tmp_path: Path) -> None:
    train = [log(length, seed, 0.1) for seed, length in enumerate((60, 25))]
    study = studied(tmp_path, UNSEEN, train, [log(20, 9, 0.1)], UNITS, "horizon = 0.5")
    bench = open_bench(study)
    assert bench.base.train.continued
    part = part_of(bench.study, bench.data)
    assert part is not None
    own = part.of(bench.base)
    rows = scored(bench.study, part.data, own, candidates(bench.study, bench.data.train))
    assert min(rows, key=lambda row: row.p_value).effect == "coulomb"


@pytest.mark.parametrize(("late", "coulomb"), [(0.0, COULOMB), (0.4, 0.0)])
def test_delays_of_inputs_are_sought_on_the_part(
    late: float, coulomb: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lengths: list[int] = []

    def counted(study: Study, data: Data, *given: Any, **more: Any) -> Fitted:
        lengths.append(len(data.train))
        return fit_model(study, data, *given, **more)

    monkeypatch.setattr(hold_trials, "fit_model", counted)
    logs = [
        log(length, seed, late=late, coulomb=coulomb, steady=3)
        for seed, length in enumerate((40, 20, 10))
    ]
    study = studied(tmp_path, OPEN, logs[:2], logs[2:], UNITS, "horizon = 0.5")
    held = open_bench(study).study.holds["torque"]
    assert held.hold == "zero"
    assert held.late == pytest.approx(late, abs=0.02)
    # With lines, and held without delay; a delay that the part shows is refined on the whole.
    assert len(lengths) <= (10 if late else 2)
