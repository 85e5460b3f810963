"""A contact that slips after a thousandth of the travel, as a bearing's does."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.explain.explain import explain
from tests.workbench.machine import Table, studied, tones, with_healthy
from tests.workbench.simulated import knowing

SLIDE = """
name = "slide"
summary = "Position and force of a slide on a soft spring, from the current of its motor."
hold = "linear"
inputs.current = { unit = "A" }
quantities.push = { expression = "kt*current - c*v - k*x + load", unit = "N" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "push/m" }
parameters.m = { value = 0.8, unit = "kg", low = 0.1, high = 10.0 }
parameters.kt = { value = 10.0, unit = "N/A", fixed = true, low = 1.0, high = 100.0 }
parameters.c = { value = 3.0, unit = "N s/m", low = 0.0, high = 100.0 }
parameters.k = { value = 150.0, unit = "N/m", low = 10.0, high = 5000.0 }
outputs.position = { unit = "m", expression = "x" }
outputs.acceleration = { unit = "m/s^2", expression = "push/m" }
[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
SLIDE_UNITS = {"current": "A", "position": "m", "acceleration": "m/s^2"}
RUBS = ("coulomb", "dahl", "stribeck", "viscous")
SLIPS, FRICTION = 40e-6, 0.9
"""Distance after which the contact slips [m], and its friction [N]."""


def rubbed(seed: int, friction: float, seconds: float = 25.0, finer: int = 20) -> Table:
    """A slide that moves by centimetres on a contact that bends (Dahl, exponential law)."""
    draw = np.random.default_rng(seed)
    rate = 200.0
    t = np.arange(0, seconds, 1 / rate)
    current = 0.12 * tones(draw, t, 0.2, 3.0, 8)
    x, v, bent, step = 0.0, 0.0, 0.0, 1 / rate / finer
    position, acceleration = np.empty(len(t)), np.empty(len(t))
    for n in range(len(t)):
        ahead = min(n + 1, len(t) - 1)
        for share in np.arange(finer) / finer:
            given = 10 * ((1 - share) * current[n] + share * current[ahead])
            pushed = (given - 2.5 * v - 200 * x - friction * bent) / 1.1
            if not share:
                position[n], acceleration[n] = x, pushed
            moved = step * (v + step * pushed / 2)
            way = np.sign(moved)
            bent = way - (way - bent) * np.exp(-abs(moved) / SLIPS) if moved else bent
            x, v = x + moved, v + step * pushed
    position += 2e-6 * draw.normal(size=len(t))
    acceleration += 5e-3 * draw.normal(size=len(t))
    return {"current": current, "position": position, "acceleration": acceleration}


@pytest.mark.nightly
def test_a_contact_that_slips_after_a_thousandth_of_the_travel_is_described(tmp_path: Path) -> None:
    tables = [rubbed(seed, FRICTION) for seed in range(2)]
    study = studied(tmp_path, SLIDE, tables[:1], tables[1:], SLIDE_UNITS, rates=[200.0] * 2)
    checked = with_healthy(study, rubbed(2, 0.0), SLIDE_UNITS, 200.0)
    found = explain(knowing(checked, *RUBS))
    assert found.verdict == "missing_effect"
    best = found.ranking[0]
    assert (best.effect, best.port) == ("dahl", "load")
    assert 1 / best.parameters["s"].value == pytest.approx(SLIPS, rel=0.1)
    assert best.parameters["Fc"].value == pytest.approx(FRICTION, rel=0.03)
    assert best.held_out_error < 1.5 * found.comparison.noise_floor
