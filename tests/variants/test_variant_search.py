"""Commissioning takes a variant of the equations if the healthy recordings ask for it."""

from pathlib import Path

import numpy as np
import pytest

from monitor.commissioning.equations.fitted_equations import fitted_equations
from monitor.model import EquationsPlant
from monitor.observer import equations_of
from monitor.signals.recordings import recording_of
from tests.variants.pushed import DAMPER, MODEL, RATE, STIFF, pushed


def commissioned(compressed: float, folder: Path) -> EquationsPlant:
    model = folder / "pushed.toml"
    model.write_text(MODEL)
    turns = 2.0 * np.pi * np.arange(round(14.0 * RATE)) / RATE
    tones = {"slow": 2.0 * turns, "middle": 4.7 * turns, "fast": 9.0 * turns}
    recordings = [
        recording_of("healthy", name, RATE, pushed(np.sin(phase), compressed, seed))
        for seed, (name, phase) in enumerate(tones.items())
    ]
    return fitted_equations(recordings, str(model), 1.0, RATE, [False] * 3, {})


def test_the_variant_whose_law_the_machine_has_is_taken(tmp_path: Path) -> None:
    plant = commissioned(STIFF, tmp_path)

    assert plant.variants == ("compressed",)
    assert plant.names == tuple(equations_of(plant).parameters)
    assert dict(zip(plant.names, plant.values, strict=True))["B"] == pytest.approx(STIFF, rel=0.05)


def test_equations_that_leave_only_noise_are_taken_as_they_are(tmp_path: Path) -> None:
    plant = commissioned(0.0, tmp_path)

    assert plant.variants == ()
    assert dict(zip(plant.names, plant.values, strict=True))["c"] == pytest.approx(DAMPER, rel=0.05)
