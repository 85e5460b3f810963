"""A change of what the model's own parameters stand for is not taken for an effect like it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.explain.changed_parameters import undetermined_if_parameters_changed
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.ranking import no_progress
from tests.workbench.rigs.test_off_middle import bench
from tests.workbench.verdicts.test_refinements import MODEL, Machine

DRIVEN = (
    MODEL.replace("w*(u - s)", "w*(g*drive - s)")
    + """
[parameters.g]
value = 1.0
unit = "1"
kept = true
[ports.drive]
kind = "actuator"
signal = "u"
"""
)

SPEED = 60.0
"""Rate of the healthy motor [1/s]."""


def motor(slower: float, weaker: float, rubbing: float) -> Machine:
    """A motor that is slower or weaker by a share, or a load that rubs [N]."""

    @kernel()
    def moved(u: np.ndarray, strength: float, steps: int, h: float) -> np.ndarray:
        """Position and acceleration at each sample."""
        out = np.zeros((u.size, 2))
        x = v = s = 0.0
        for n in range(u.size):
            for j in range(steps):
                a = s - 2.0 * v - 100.0 * x - strength * rubbing * np.tanh(v / 1e-4)
                if j == 0:
                    out[n, 0], out[n, 1] = x, a
                v += h * a
                x += h * v
                drive = (1.0 - strength * weaker) * u[n]
                s += h * SPEED * (1.0 - strength * slower) * (drive - s)
        return out

    return moved


def test_a_slower_motor_is_no_weaker_one(tmp_path: Path) -> None:
    slower = bench(tmp_path, motor(0.15, 0.0, 0.0), DRIVEN)
    rows, verdict = ranking(slower)
    named = replace(verdict, word="missing_effect")
    assert rows[0].label == "gain@drive"

    found = undetermined_if_parameters_changed(slower, named, no_progress)

    assert found.word == "undetermined"
    assert "gain@drive lowers the held-out error" in found.text
    assert "parameters of the model" in found.text


@pytest.mark.parametrize(
    ("weaker", "rubbing", "label"), [(0.05, 0.0, "gain@drive"), (0.0, 0.15, "coulomb@load")]
)
def test_an_effect_that_leaves_nothing_is_named(
    tmp_path: Path, weaker: float, rubbing: float, label: str
) -> None:
    rows, verdict = ranking(bench(tmp_path, motor(0.0, weaker, rubbing), DRIVEN))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == label
