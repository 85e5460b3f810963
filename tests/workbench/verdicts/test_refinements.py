"""A guide that binds and bends before it slips is found by a refinement of `binding`."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.machine import Table, studied, with_healthy

MODEL = """
name = "slide"
summary = "A lagging motor moves a mass on a spring; position and acceleration are measured."
inputs.u = { unit = "N", hold = "zero" }
states.x = { unit = "m", derivative = "v", measured = "x" }
states.v = { unit = "m/s", derivative = "acceleration", rate_of = "x" }
states.s = { unit = "N", derivative = "w*(u - s)" }
quantities.acceleration = { expression = "(s - c*v - k*x + load)/m", unit = "m/s^2" }
parameters.m = { value = 1.0, unit = "kg", fixed = true }
parameters.c = { value = 2.0, unit = "N s/m", low = 0.0, kept = true }
parameters.k = { value = 100.0, unit = "N/m", low = 0.0, kept = true }
parameters.w = { value = 50.0, unit = "1/s", low = 1.0, high = 500.0, kept = true }
outputs.x = { unit = "m", expression = "x" }
outputs.a = { unit = "m/s^2", expression = "acceleration" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"u": "N", "x": "m", "a": "m/s^2"}
RATE, STEPS = 256.0, 40
CENTRE, REACH = 0.004, 2e-4


@kernel(allocates=True)
def _moved(u: np.ndarray, binding: float, steps: int, h: float, one_sided: bool) -> np.ndarray:
    """Position and acceleration at each sample; the force of the contact is bent over `REACH`."""
    out = np.zeros((u.size, 2))
    x = v = s = z = 0.0
    for n in range(u.size):
        for j in range(steps):
            touches = 1.0 / (1.0 + np.exp(-(x - CENTRE) / 5e-4)) if one_sided else abs(x - CENTRE)
            a = s - 2.0 * v - 100.0 * x - binding * touches * z
            if j == 0:
                out[n, 0], out[n, 1] = x, a
            v += h * a
            x += h * v
            z += h * (v - abs(v) * z) / REACH
            s += h * 60.0 * (u[n] - s)
    return out


def slid(u: np.ndarray, binding: float, steps: int, h: float) -> np.ndarray:
    """The contact is pressed the more the further from `CENTRE`."""
    return _moved(u, binding, steps, h, False)


def touched(u: np.ndarray, binding: float, steps: int, h: float) -> np.ndarray:
    """The contact touches above `CENTRE` only."""
    return _moved(u, binding, steps, h, True)


Machine = Callable[[np.ndarray, float, int, float], np.ndarray]


def run(seed: int, strength: float, samples: int = 4096, machine: Machine = slid) -> Table:
    """A log of the machine under a multisine, with an effect of that strength and noise."""
    generator = np.random.default_rng(seed)
    lines = np.arange(3, 120)
    spectrum = np.zeros(513, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(7).random(lines.size))
    drive = np.fft.irfft(spectrum, 1024)
    u = np.tile(2.0 * drive / drive.std(), samples // 1024)
    moved = machine(u, strength, STEPS, 1.0 / (RATE * STEPS))
    moved += generator.normal(size=moved.shape) * [2e-6, 0.01]
    return {"u": u, "x": moved[:, 0], "a": moved[:, 1]}


@pytest.mark.nightly
def test_presliding_and_centre_of_a_slide_that_binds_are_found(tmp_path: Path) -> None:
    made = studied(tmp_path, MODEL, [run(0, 20.0)], [run(1, 20.0)], UNITS, rates=[RATE, RATE])
    bench = open_bench(with_healthy(made, run(2, 0.0), UNITS, RATE))
    assert bench.data.along_motion

    rows, verdict = ranking(bench)

    assert verdict.word == "missing_effect"
    assert verdict.best is rows[0]
    assert verdict.best.label == "binding_with_memory@load"
    assert verdict.best.fitted is not None
    values = verdict.best.fitted.train.values()
    assert abs(values["load_binding_with_memory_xb"] - CENTRE) < 1e-4
    strength = values["load_binding_with_memory_Fb"] / values["load_binding_with_memory_xe"]
    assert abs(strength / 20.0 - 1) < 0.05
    coarse = next(row for row in rows if row.label == "binding@load")
    assert not coarse.accepted
    assert coarse.reason == "leaves much that binding_with_memory@load explains"
    # Rows know the refinement as they know each other.
    assert all(verdict.best.label in row.cosines for row in rows if row is not verdict.best)


@pytest.mark.nightly
def test_presliding_of_a_slide_that_binds_on_one_side_is_found(tmp_path: Path) -> None:
    logs = [run(seed, holds, machine=touched) for seed, holds in ((0, 0.6), (1, 0.6), (2, 0.0))]
    made = studied(tmp_path, MODEL, logs[:1], logs[1:2], UNITS, rates=[RATE, RATE])

    rows, verdict = ranking(open_bench(with_healthy(made, logs[2], UNITS, RATE)))

    assert verdict.word == "missing_effect"
    assert rows[0].label == "binding_past_with_memory@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_binding_past_with_memory_xb"] - CENTRE) < 2e-4
    assert abs(values["load_binding_past_with_memory_Fb"] / 0.6 - 1) < 0.05
