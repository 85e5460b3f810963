"""A model whose fit did not converge: the verdict tells where it fails and what to look at."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.search import Convergence
from rigwatch.workbench.compare import locate, open_bench
from rigwatch.workbench.explain import ranking
from rigwatch.workbench.fit import each_recording
from tests.workbench.machine import Table, studied
from tests.workbench.simulated import knowing

BLOCK = """
name = "block"
summary = "A block that a heater warms."
hold = "zero"
inputs.power = { unit = "W" }
states.T = { unit = "K", derivative = "(g*heater - T)/tau", measured = "warmer" }
parameters.g = { value = 1.0, unit = "K/W", low = 0.0 }
parameters.tau = { value = 2.0, unit = "s", low = 0.1 }
outputs.warmer = { unit = "K", expression = "T" }
ports.heater = { kind = "actuator", signal = "power" }
"""
UNITS = {"power": "W", "warmer": "K"}
DT, TAU, LIMIT, NOISE, SAMPLES, STEADY = 0.1, 3.0, 80.0, 0.1, 800, 20
NOT_CONVERGED = Convergence(False, 0.3, 5, 1, (), (), "the given values", "stuck")


def log(seed: int, tau: float = TAU, limit: float = np.inf) -> Table:
    """A block whose heater gives no more than a limit, exact from sample to sample."""
    draw = np.random.default_rng(seed)
    power = np.repeat(draw.uniform(0, 100, SAMPLES // STEADY), STEADY)
    warmer, kept = np.zeros(SAMPLES), np.exp(-DT / tau)
    for k, given in enumerate(np.minimum(power[:-1], limit)):
        warmer[k + 1] = given + (warmer[k] - given) * kept
    return {"power": power, "warmer": warmer + NOISE * draw.normal(size=SAMPLES)}


def said(folder: Path, logs: list[Table]) -> str:
    """What the verdict says of logs to which the model cannot be fitted, the last held out."""
    bench = open_bench(studied(folder, BLOCK, logs[:-1], logs[-1:], UNITS, "horizon = 4.0",
                               rates=[1 / DT] * len(logs)))  # fmt: skip
    failed = replace(bench, base=replace(bench.base, convergence=NOT_CONVERGED))
    verdict = ranking(replace(failed, study=knowing(failed.study)))[1]
    assert verdict.word == "model_inadequate"
    assert verdict.text.startswith("the fit of the model did not converge: stuck; ")
    assert "; `rigwatch locate " in verdict.text
    assert " EFFECT --port PORT` tries what may act there" in verdict.text
    return verdict.text


def test_it_is_told_at_which_input_the_model_fails(tmp_path: Path) -> None:
    text = said(tmp_path, [log(seed, limit=LIMIT) for seed in range(3)])
    assert "most is left of warmer: " in text
    low = re.search(r"of it at \|power\| ([\d.]+) to 9", text)
    assert low is not None
    assert float(low[1]) > 0.9 * LIMIT
    assert "disagree" not in text


def test_it_is_told_on_which_parameter_recordings_disagree(tmp_path: Path) -> None:
    text = said(tmp_path, [log(0), log(1, tau=2 * TAU), log(2)])
    apart = re.search(r"disagree: tau is (\S+) s \(.*\) in (\S+) and (\S+) s \(.*\) in ([^;]+)",
                      text)  # fmt: skip
    assert apart is not None
    assert float(apart[1]) == pytest.approx(TAU, rel=0.05)
    assert float(apart[3]) == pytest.approx(2 * TAU, rel=0.05)
    assert (apart[2].endswith("train0.mcap"), apart[4].endswith("train1.mcap")) == (True, True)
    assert "g is" not in text


def test_each_recording_is_a_part_with_its_own_windows(tmp_path: Path) -> None:
    logs = [log(seed) for seed in range(3)]
    bench = open_bench(studied(tmp_path, BLOCK, logs[:2], logs[2:], UNITS, "horizon = 4.0",
                               rates=[1 / DT] * 3))  # fmt: skip
    whole, parts = bench.data.train, each_recording(bench.study, bench.data)
    assert len(parts) == 2
    np.testing.assert_array_equal(np.concatenate([part.windows for part in parts]), np.arange(40))
    for part, own in zip(parts, whole.slices, strict=True):
        np.testing.assert_array_equal(part.data.train.outputs, whole.outputs[own])
        assert len(part.of(bench.base).train.residuals) == len(part.data.train) / 40


def test_the_time_at_which_the_model_fails_is_that_of_its_recording(tmp_path: Path) -> None:
    logs = [log(seed) for seed in range(3)]
    logs[1]["warmer"][420:460] += 8.0
    bench = open_bench(studied(tmp_path, BLOCK, logs[:2], logs[2:], UNITS, "horizon = 4.0",
                               rates=[1 / DT] * 3))  # fmt: skip
    by_time = [region for region in locate(bench) if region.view == "time"]
    worst = max(by_time, key=lambda region: region.rms)
    place = re.fullmatch(r".*train1\.mcap, ([\d.]+) to ([\d.]+) s", worst.name)
    assert place is not None
    assert float(place[1]) <= 42.0 < float(place[2]) <= SAMPLES * DT
    assert {len(region.samples) for region in by_time} == {SAMPLES // 6, SAMPLES // 6 + 1}
