"""What a recording is said not to tell apart has been fitted: a long lag is no delay."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.machine import Table, studied
from tests.workbench.simulated import with_few_effects

CART = """
name = "cart"
summary = "A cart on a rail, pushed."
hold = "zero"
inputs.push = { unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(push - b*v - k*x)/m" }
parameters.m = { value = 3.0, unit = "kg", low = 0.1 }
parameters.b = { value = 5.0, unit = "N s/m", low = 0.0 }
parameters.k = { value = 60.0, unit = "N/m", low = 1.0 }
outputs.position = { unit = "m", expression = "x" }
outputs.force = { unit = "N", expression = "push - m*(push - b*v - k*x)/m" }
ports.cell = { kind = "sensor", signal = "force" }
"""
RATE, LAG = 100.0, 0.06


def pushed(seed: int, lag_s: float) -> Table:
    """The cart under held pushes, and the force at its foot as a load cell with a lag reads it."""
    draw = np.random.default_rng(seed)
    push = np.repeat(draw.uniform(-4, 4, 60), 50)
    x = v = read = 0.0
    told = []
    for force in push:
        told.append((x, read))
        for _ in range(20):
            foot = 5.0 * v + 60.0 * x
            read += (foot - read) / lag_s / (20 * RATE)
            v += (force - foot) / 2.0 / (20 * RATE)
            x += v / (20 * RATE)
    position, cell = np.array(told).T
    noise = draw.normal(size=(2, len(push)))
    return {
        "push": push,
        "position": position + 1e-3 * np.std(position) * noise[0],
        "force": cell + 1e-3 * np.std(cell) * noise[1],
    }


def test_a_lag_of_many_samples_is_named_alone(tmp_path: Path) -> None:
    units = {"push": "N", "position": "m", "force": "N"}
    made = studied(tmp_path, CART, [pushed(1, LAG)], [pushed(2, LAG)], units)
    bench = with_few_effects(open_bench(made), "digital_smoothing", "moving_average")
    rows, verdict = ranking(bench)
    assert (verdict.word, verdict.members) == ("missing_effect", ("lag@cell",))
    others = [row for row in rows if row.port == "cell" and row.label in rows[0].alike]
    assert all(row.fitted is not None for row in others)
    assert len(others) >= 2
