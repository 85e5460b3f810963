"""Machines without inputs, and states that no channel shows: what the next recording would tell."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.experiment.next_experiment import _first_states, _rest, excitation, propose
from rigwatch.workbench.ranking.scoring import rank_all
from tests.workbench.machine import studied

FREE = """
name = "swing"
summary = "A mass on a spring, released; nothing drives it."
states.x = { unit = "m", derivative = "v", measured = "x" }
states.v = { unit = "m/s", derivative = "-k*x - c*v + load", rate_of = "x" }
parameters.k = { value = 80.0, unit = "1/s^2", low = 1.0, high = 1e4 }
parameters.c = { value = 0.3, unit = "1/s", low = 0.0, high = 1e2 }
outputs.x = { unit = "m", expression = "x" }
[ports.load]
kind = "force"
unit = "m/s^2"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
HEATED = """
name = "heated"
summary = "A plate that cools to a block, whose temperature no channel shows."
inputs.q = { unit = "K/s" }
states.a = { unit = "K", derivative = "q - g*(a - b) + load", measured = "a" }
states.b = { unit = "K", derivative = "0.1*g*(a - b)" }
parameters.g = { value = 0.3, unit = "1/s", low = 0.01, high = 10.0 }
outputs.a = { unit = "K", expression = "a" }
[ports.load]
kind = "force"
unit = "K/s"
variables.x = { expression = "a", unit = "K" }
"""


def released(seed: int, start: float) -> dict[str, np.ndarray]:
    """A mass that swings out with dry friction; semi-implicit steps of 0.2 ms."""
    x, v, found = start, 0.0, []
    for step in range(2000 * 50):
        if step % 50 == 0:
            found.append(x)
        v += 2e-4 * (-100.0 * x - 0.5 * v - 0.3 * np.tanh(v / 1e-3))
        x += 2e-4 * v
    noise = 1e-4 * np.random.default_rng(seed).normal(size=len(found))
    return {"x": np.array(found) + noise}


def test_a_machine_without_inputs_is_released_to_tell_rivals_apart(tmp_path: Path) -> None:
    tables = [released(seed, start) for seed, start in enumerate((0.03, 0.1, 0.08))]
    bench = open_bench(studied(tmp_path, FREE, tables[:2], tables[2:], {"x": "m"}))
    rows = {row.label: row for row in rank_all(bench.study, bench.data, bench.base)}
    found = propose(bench, rows["coulomb@load"], [rows["quadratic_drag@load"]])
    assert found is not None
    assert (found.shape, found.signal, found.unit) == ("release", "x", "m")
    assert found.separation["quadratic_drag@load"] > found.now["quadratic_drag@load"]
    assert "release of x from" in found.text
    assert excitation(bench, found).shape[1] == 0


def warmed(seed: int) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)
    q = np.repeat(generator.uniform(0, 4, 40), 50)
    a, b, found = 330.0, 310.0, []
    for heat in q:
        found.append(a)
        for _ in range(20):
            flow = 0.5 * (a - b)
            a, b = a + 5e-4 * (heat - flow), b + 5e-4 * 0.1 * flow
    return {"q": q, "a": np.array(found) + 0.01 * generator.normal(size=len(q))}


def test_an_experiment_begins_where_a_hidden_state_was_fitted(tmp_path: Path) -> None:
    units = {"q": "K/s", "a": "K"}
    bench = open_bench(studied(tmp_path, HEATED, [warmed(0)], [warmed(1)], units))
    # Its default is 0 K, at which the plate would lose all its heat to the block at once.
    assert abs(_first_states(bench)[1] - 310.0) < 5.0
    assert 300.0 < _rest(bench)[1] < 340.0
