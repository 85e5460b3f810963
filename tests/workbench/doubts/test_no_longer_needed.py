"""An effect that a later one replaces stays in the model: the step says so."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study import open_study
from tests.workbench.machine import studied

DAMPER = """
name = "damper"
summary = "Force of a damper that is moved along a path."
inputs.x = { unit = "mm" }
inputs.v = { unit = "mm/s" }
parameters.c = { value = 1.0, unit = "N*s/mm" }
outputs.force = { unit = "N", expression = "c*v - rod" }
[ports.rod]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "mm" }
variables.v = { expression = "v", unit = "mm/s" }
"""
UNITS = {"x": "mm", "v": "mm/s", "force": "N"}
GAP, SLIDER, STIFFNESS = 4.0, 8.0, 6.0
"""Width [mm], friction [N] and stiffness [N/mm] of a slider behind a gap."""


def moved(seed: int) -> dict[str, np.ndarray]:
    """A path of growing amplitude; the slider follows what pushes it through the gap."""
    draw = np.random.default_rng(seed)
    time = np.arange(3000) / 100
    x = (4.0 + 8.0 * time / 30) * np.sin(2 * np.pi * draw.uniform(0.4, 0.6) * time)
    v = np.gradient(x, 0.01)
    pushed, force = 0.0, np.zeros(len(x))
    for i in range(1, len(x)):
        before = pushed
        pushed = np.clip(pushed, x[i] - GAP / 2, x[i] + GAP / 2)
        force[i] = np.clip(force[i - 1] + STIFFNESS * (pushed - before), -SLIDER, SLIDER)
    return {"x": x, "v": v, "force": 0.05 * v + force + 0.05 * draw.normal(size=len(x))}


@pytest.mark.nightly
def test_what_a_better_law_replaces_is_said_to_be_needless(tmp_path: Path) -> None:
    study = studied(tmp_path, DAMPER, [moved(0), moved(1)], [moved(2)], UNITS)
    first = add(study, "jenkins", "rod")
    assert "no longer needed" not in first.text
    second = add(open_study(study.folder), "jenkins_behind_gap", "rod")
    assert second.step == "add"
    assert "jenkins@rod is no longer needed (Fc = " in second.text
    assert f"`rigwatch undo {study.folder}` 2 times" in second.text
