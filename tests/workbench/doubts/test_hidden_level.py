"""Two tanks, the upper of which no channel shows: it does not stand in for what is missing."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.model import model_text
from rigwatch.workbench.explain.explain import explain
from sim_plant.machines import MACHINES, log, strength_for
from tests.workbench.fits.test_horizon import CASCADE
from tests.workbench.machine import studied


def tanks(seed: int, samples: int = 320) -> dict[str, np.ndarray]:
    """A pump that gives nothing below 1 V; Euler steps of 0.1 s, read every 4 s."""
    draw = np.random.default_rng(seed)
    time = 4.0 * np.arange(samples)
    pump = 3.0 + sum(
        draw.uniform(0.3, 1.0) * np.sin(2 * np.pi * f * time + draw.uniform(0, 6.28))
        for f in draw.uniform(1 / 900, 1 / 120, size=8)
    )
    pump, upper, lower, level = np.clip(pump, 0.5, 7.0), 6.0, 5.0, np.empty(samples)
    for row, volts in enumerate(pump):
        level[row] = lower
        for _ in range(40):
            falls, leaves = 0.055 * np.sqrt(upper), 0.06 * np.sqrt(lower)
            upper = max(upper + 0.1 * (0.05 * max(volts - 1.0, 0.0) - falls), 0.0)
            lower = max(lower + 0.1 * (falls - leaves), 0.0)
    return {"pump": pump, "level": level + 0.015 * draw.normal(size=samples)}


def test_a_dead_band_is_named_although_an_offset_is_like_it_to_first_order(tmp_path: Path) -> None:
    units = {"pump": "V", "level": "V"}
    study = studied(tmp_path, CASCADE, [tanks(11)], [tanks(111)], units, rates=[0.25] * 2)
    found = explain(study)
    assert found.verdict == "missing_effect"
    assert found.ranking[0].effect == "dead_band"
    assert 0.98 < found.ranking[0].parameters["b"].value < 1.02


@pytest.mark.nightly
def test_it_is_named_in_a_plant_that_is_integrated_another_way(tmp_path: Path) -> None:
    plant = MACHINES["cascade"]
    hidden = {"dead_band": strength_for(plant, "dead_band", 0.5, seed=1)}
    tables = [log(plant, hidden, 0.005, seed) for seed in (1, 1001)]
    named = [{"voltage": t["voltage_V"], "level": t["level_m"]} for t in tables]
    study = studied(
        tmp_path, model_text("cascade"), named[:1], named[1:], {"voltage": "V", "level": "m"},
        "start = { A1 = 0.0031, A2 = 0.0026 }", [plant.rate] * 2,
    )  # fmt: skip
    found = explain(study)
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "dead_band")
    strength = found.ranking[0].parameters["b"].value
    assert abs(strength / hidden["dead_band"] - 1) < 0.05
