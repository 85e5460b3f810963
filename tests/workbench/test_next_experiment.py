"""A recording cannot decide; the experiment that is proposed does."""

from pathlib import Path

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, bench_of, open_bench
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.experiment.next_experiment import excitation
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import rank_only, refit, shapes_of
from sim_plant.oscillator import RATE, Hidden, strength_for
from tests.workbench.dampers import damper
from tests.workbench.simulated import HORIZON, recorded, size_of, study

SINE = 4 * np.sin(2 * np.pi * 3.0 * np.arange(5120) / RATE)
NOISE = 0.02 * size_of(SINE)
HIDDEN = (Hidden("quadratic_stiffness", strength_for("quadratic_stiffness", SINE, 0.02)),)


def bench_under(force: FloatArray, seed: int) -> Bench:
    """The plant driven by a force, its spring lopsided but for the healthy recording."""
    train, held_out, healthy = (
        recorded(force, effects, NOISE, seed + 50 * k)
        for k, effects in enumerate((HIDDEN, HIDDEN, ()))
    )
    data = Data(train, held_out, healthy, HORIZON, ())
    return bench_of(study(), data, 2e-3 * np.nanstd(train.outputs, axis=0))


def test_the_proposed_experiment_tells_a_lopsided_spring_from_the_fault_of_a_signal() -> None:
    bench = bench_under(SINE, seed=3)
    rows, verdict = ranking(bench)
    assert verdict.word == "undetermined", "one sine must not be enough"
    assert any("@load" not in rival for rival in verdict.rivals), "a signal's fault does the same"
    proposed = explanation(bench, rows, verdict).next_experiment
    assert proposed is not None
    _, after = ranking(bench_under(excitation(bench, proposed)[:, 0], seed=13))
    assert after.word == "missing_effect"
    assert "quadratic_stiffness@load" in after.members


def test_no_experiment_is_proposed_for_a_rival_that_has_no_row(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 3 * np.tanh(v / 0.005)))
    row = rank_only(
        bench.study, bench.data, bench.base,
        shapes_of(bench.study, bench.data.train, "coulomb", "load"),
    )  # fmt: skip
    refit(bench.study, bench.data, bench.base, row)
    verdict = Verdict("undetermined", row, (row.label,), ("digital_smoothing@drive",), "")
    found = explanation(bench, [row], verdict)
    assert found.next_experiment is None
    assert found.rivals == ["digital_smoothing@drive"]
