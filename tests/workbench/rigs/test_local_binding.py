"""A slide that binds at one place of its travel is found, though another effect is best first."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.kernel import kernel
from rigwatch.workbench.explain.explain import ranking
from tests.workbench.rigs.test_off_middle import bench
from tests.workbench.verdicts.test_refinements import Machine

FORCE, HALF_WIDTH = 0.8, 0.01


def dented(place: float) -> Machine:
    """A slide with a dent that rubs over twice the half width, as a raised cosine."""

    @kernel()
    def moved(u: np.ndarray, strength: float, steps: int, h: float) -> np.ndarray:
        """Position and acceleration at each sample."""
        out = np.zeros((u.size, 2))
        x = v = s = 0.0
        for n in range(u.size):
            for j in range(steps):
                near = min(abs(x - place) / HALF_WIDTH, 1.0)
                rubbing = strength * FORCE * 0.5 * (1.0 + np.cos(np.pi * near)) * np.tanh(v / 1e-4)
                a = s - 2.0 * v - 100.0 * x - rubbing
                if j == 0:
                    out[n, 0], out[n, 1] = x, a
                v += h * a
                x += h * v
                s += h * 60.0 * (u[n] - s)
        return out

    return moved


@pytest.mark.parametrize("place", [-0.012, 0.008])
def test_the_place_where_a_slide_binds_is_found(tmp_path: Path, place: float) -> None:
    rows, verdict = ranking(bench(tmp_path, dented(place)))

    assert verdict.word == "missing_effect", verdict.text
    assert rows[0].label == "local_binding@load"
    assert rows[0].fitted is not None
    values = rows[0].fitted.train.values()
    assert abs(values["load_local_binding_xb"] - place) < 5e-4
    assert abs(values["load_local_binding_Fb"] / FORCE - 1) < 0.1
