"""A recording cannot decide; the experiment that is proposed does."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, bench_of, open_bench
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.experiment.next_experiment import (
    _first_states,
    _separation,
    excitation,
    propose,
)
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import rank_only, refit, shapes_of
from sim_plant.oscillator import RATE, Hidden, strength_for
from tests.workbench.dampers import damper
from tests.workbench.machine import studied
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


@pytest.mark.nightly
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
    assert found.like_this == (0, 0)
    assert found.wrong_probability is None, "no simulated case is like this one"


KILN = """
name = "kiln"
summary = "A kiln that warms for an hour."
hold = "zero"
inputs.power = { unit = "W" }
parameters.C = { value = 4e6, unit = "J/K", low = 1e3 }
parameters.G = { value = 1000.0, unit = "W/K", low = 0.0 }
outputs.warmth = { unit = "K", expression = "T" }
[states.T]
unit = "K"
derivative = "(heater - G*T)/C"
measured = "warmth"
[ports.heater]
kind = "actuator"
signal = "power"
[ports.probe]
kind = "sensor"
signal = "warmth"
"""
EVERY = 60.0


def kiln(seed: int) -> dict[str, np.ndarray]:
    """A reading a minute; half an hour at each power, and a heater with an offset."""
    draw = np.random.default_rng(seed)
    power = np.repeat(draw.uniform(1e4, 9e4, 14), 30)
    warmth = np.zeros(power.size)
    for k in range(1, power.size):
        rest = (power[k - 1] + 6e3) / 1e3
        warmth[k] = rest + (warmth[k - 1] - rest) * np.exp(-EVERY / 4e3)
    return {"power": power, "warmth": warmth + 0.05 * draw.normal(size=power.size)}


def test_an_experiment_on_a_slow_machine_lasts_as_long_as_its_recordings(tmp_path: Path) -> None:
    units, rates = {"power": "W", "warmth": "K"}, (1 / EVERY, 1 / EVERY)
    bench = open_bench(studied(tmp_path, KILN, [kiln(1)], [kiln(2)], units, rates=rates))
    shapes = [
        shapes_of(bench.study, bench.data.train, *label)
        for label in (("offset", "heater"), ("offset", "probe"))
    ]
    rows = [rank_only(bench.study, bench.data, bench.base, found) for found in shapes]
    proposed = propose(bench, rows[0], rows[1:])
    assert proposed is not None
    samples = len(excitation(bench, proposed))
    assert samples > 300
    assert proposed.duration == pytest.approx(samples * EVERY, rel=0.01)
    assert f"{proposed.duration:.3g} s: offset@probe would differ" in proposed.text


def test_rivals_are_compared_in_the_shape_that_was_fitted(tmp_path: Path) -> None:
    bench = open_bench(damper(tmp_path, lambda x, v: 3 * np.sign(v) * np.exp(-np.abs(v) / 0.01)))
    rows = [
        rank_only(bench.study, bench.data, bench.base, found)
        for name in ("stribeck", "linear_stiffness")
        if (found := shapes_of(bench.study, bench.data.train, name, "load"))
    ]
    for row in rows:
        refit(bench.study, bench.data, bench.base, row)
    assert rows[0].fitted is not None
    # The speed over which it falls, as fitted, is none of those that were tried.
    values = rows[0].placement.own(rows[0].fitted.train.values())
    assert values["vst"] != rows[0].start["vst"]
    inputs, first = bench.data.train.inputs, _first_states(bench)
    as_fitted = _separation(bench, rows, inputs, first)
    rows[0].start = values
    assert as_fitted == _separation(bench, rows, inputs, first)
