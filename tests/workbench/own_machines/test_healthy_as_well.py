"""What a healthy recording shows as strongly is not missing since, unless it explains the error."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.study import Study
from tests.workbench.machine import Table, studied, tones, with_healthy
from tests.workbench.simulated import knowing

CARRIAGE = """
name = "carriage"
summary = "Position of a carriage on a spring from the force of its motor."
hold = "linear"
inputs.force = { unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "(force - c*v - k*x + load)/m" }
parameters.m = { value = 0.8, unit = "kg", low = 0.1, high = 10.0 }
parameters.c = { value = 3.0, unit = "N s/m", low = 0.0, high = 100.0 }
parameters.k = { value = 150.0, unit = "N/m", low = 10.0, high = 5000.0 }
outputs.position = { unit = "m", expression = "x" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
[ports.gauge]
kind = "sensor"
signal = "position"
"""
UNITS = {"force": "N", "position": "m"}
RATE, SUBSTEPS, NOISE = 100.0, 10, 2e-4
SLIGHT, STRONG = 250.0, 1500.0


def moved(seed: int, cubic: float, seconds: float = 60.0) -> Table:
    """Position under a force of many tones, with a spring that hardens [N/m^3]."""
    draw = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / RATE)
    force = 1.2 * tones(draw, t, 0.1, 5.0, 12)
    x, v, found, step = 0.0, 0.0, np.empty(len(t)), 1 / RATE / SUBSTEPS
    for n in range(len(t)):
        found[n] = x
        ahead = min(n + 1, len(t) - 1)
        for share in np.arange(SUBSTEPS) / SUBSTEPS:
            pushed = (1 - share) * force[n] + share * force[ahead]
            v += step * (pushed - 2.5 * v - 200 * x - cubic * x**3) / 1.1
            x += step * v
    return {"force": force, "position": found + NOISE * draw.normal(size=len(t))}


def asked(folder: Path, cubic: float) -> Study:
    tables = [moved(seed, cubic) for seed in range(3)]
    study = studied(folder, CARRIAGE, tables[:2], tables[2:], UNITS)
    return knowing(
        with_healthy(study, moved(9, cubic), UNITS), "cubic_stiffness", "coulomb", "viscous", "lag"
    )


@pytest.mark.parametrize(
    ("cubic", "word"), [(SLIGHT, "nothing_missing"), (STRONG, "missing_effect")]
)
def test_what_is_as_strong_when_healthy_is_missing_only_if_it_explains_the_error(
    tmp_path: Path, cubic: float, word: str
) -> None:
    found = explain(asked(tmp_path, cubic))
    assert found.verdict == word
    first = found.ranking[0]
    assert (first.effect, first.port) == ("cubic_stiffness", "load")
    assert first.accepted == (word == "missing_effect")
