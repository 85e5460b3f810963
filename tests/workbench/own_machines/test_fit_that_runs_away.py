"""A spring that softens: begun too soft, the motion runs away within a window of the fit."""

from pathlib import Path

import numpy as np

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.machine import Table, studied
from tests.workbench.simulated import with_few_effects

SHIP = """
name = "ship"
summary = "A ship model, rolled by a moving weight."
inputs.moment = { unit = "N m" }
states.phi = { unit = "rad", derivative = "p", measured = "roll" }
states.p = { unit = "rad/s", derivative = "(moment - b*p - G*phi + hull)/I", measured = "rate" }
parameters.I = { value = 12.0, unit = "kg m^2", low = 0.05, high = 50.0 }
parameters.b = { value = 0.1, unit = "N m s/rad", low = 0.0 }
parameters.G = { value = 93.0, unit = "N m/rad", low = 0.1, high = 1000.0 }
outputs.roll = { unit = "rad", expression = "phi" }
outputs.rate = { unit = "rad/s", expression = "p" }
[ports.hull]
kind = "force"
unit = "N m"
variables.x = { expression = "phi", unit = "rad" }
variables.v = { expression = "p", unit = "rad/s" }
"""
RATE, SUBSTEPS = 20.0, 20
INERTIA, DAMPING, RIGHTING, SOFTER = 2.4, 0.5, 30.0, -11.0


def rolled(seed: int, softer: float = SOFTER, drag: float = 0.0, seconds: float = 120.0) -> Table:
    """Roll angle and rate under a slow random moment, read with noise."""
    draw = np.random.default_rng(seed)
    count = round(seconds * RATE)
    fine = np.arange(count * SUBSTEPS) / (RATE * SUBSTEPS)
    tones = draw.uniform(0.2, 0.8, 6)
    moment = np.sin(2 * np.pi * np.outer(fine, tones) + 40 * tones).sum(axis=1) * 1.2
    angle = rate = 0.0
    angles, rates = np.empty(count), np.empty(count)
    for n, push in enumerate(moment):
        if n % SUBSTEPS == 0:
            angles[n // SUBSTEPS], rates[n // SUBSTEPS] = angle, rate
        force = (
            push - DAMPING * rate - RIGHTING * angle - softer * angle**3 - drag * rate * abs(rate)
        )
        rate += force / INERTIA / (RATE * SUBSTEPS)
        angle += rate / (RATE * SUBSTEPS)
    noise = draw.normal(size=(2, count))
    return {
        "moment": moment[::SUBSTEPS],
        "roll": angles + 0.003 * np.std(angles) * noise[0],
        "rate": rates + 0.003 * np.std(rates) * noise[1],
    }


def test_an_effect_whose_fit_runs_away_is_begun_over_short_horizons(tmp_path: Path) -> None:
    units = {"moment": "N m", "roll": "rad", "rate": "rad/s"}
    made = studied(tmp_path, SHIP, [rolled(4)], [rolled(6)], units, "horizon = 8.0", [RATE, RATE])
    verdict = ranking(with_few_effects(open_bench(made)))[1]
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "cubic_stiffness@hull")
