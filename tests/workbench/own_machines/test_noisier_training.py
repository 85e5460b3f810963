"""Training with more noise than what is held out has no more missing physics."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.machine import Table, studied

DAMPER = """
name = "damper"
summary = "A viscous damper."
inputs.v = { unit = "m/s" }
outputs.force = { unit = "N", expression = "c*v - load" }
parameters.c = { value = 1.0, unit = "N s/m", low = 0.0 }
ports.load = { kind = "force", unit = "N", variables = { v = { expression = "v", unit = "m/s" } } }
"""


def run(seed: int, noise: float, drag: float = 0.1) -> Table:
    """A damper with drag at random velocities."""
    draw = np.random.default_rng(seed)
    velocity = np.convolve(draw.normal(size=4100), np.hanning(101) / 6, "valid")[:4000]
    force = 2.0 * velocity + drag * velocity * np.abs(velocity)
    return {"v": velocity, "force": force + noise * draw.normal(size=4000)}


@pytest.mark.parametrize("noise", [0.02, 0.04], ids=["alike", "noisier"])
def test_more_noise_in_the_training_is_not_left_of_its_error(tmp_path: Path, noise: float) -> None:
    logs = [run(1, noise), run(2, noise)], [run(3, 0.02)]
    bench = open_bench(studied(tmp_path, DAMPER, *logs, {"v": "m/s", "force": "N"}))
    verdict = ranking(bench)[1]
    assert (verdict.word, verdict.members[0]) == ("missing_effect", "quadratic_drag@load")
    assert "remains" not in verdict.text
    assert bench.floor.rms == pytest.approx([0.02], rel=0.15)
    assert bench.floor.of_training.rms == pytest.approx([noise], rel=0.15)
