"""Along the measured motion lost rows cost their own samples: the motion about them is measured."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.preparation import Bench, open_bench
from tests.workbench.machine import studied, with_healthy

COIL = """
name = "coil"
summary = "A mass on a spring that a slow coil drives."
inputs.u = { unit = "V" }
states.x = { unit = "m", derivative = "v", measured = "position" }
states.v = { unit = "m/s", derivative = "acceleration", rate_of = "position" }
states.i = { unit = "A", derivative = "(u - R*i - K*v)/L" }
quantities.acceleration = { expression = "(K*i - c*v - k*x + load)/m", unit = "m/s^2" }
parameters.m = { value = 0.25, unit = "kg", fixed = true }
parameters.k = { value = 35.0, unit = "N/m", low = 0.0 }
parameters.c = { value = 0.5, unit = "N s/m", low = 0.0 }
parameters.R = { value = 1.0, unit = "ohm", fixed = true }
parameters.L = { value = 0.1, unit = "H", fixed = true }
parameters.K = { value = 3.0, unit = "N/A", low = 0.1 }
outputs.position = { unit = "m", expression = "x" }
outputs.acceleration = { unit = "m/s^2", expression = "acceleration" }

[ports.load]
kind = "force"
unit = "N"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"u": "V", "position": "m", "acceleration": "m/s^2"}
RATE, STEPS, SAMPLES = 128.0, 16, 2560


@cache
def _moved(seed: int) -> np.ndarray:
    """Rows of voltage, position and acceleration; the current of the coil is not measured."""
    generator, time = np.random.default_rng(seed), np.arange(SAMPLES) / RATE
    lines = np.arange(0.3, 5.0, 0.4)
    phases = generator.uniform(0, 2 * np.pi, len(lines))
    volts = 1.3 * np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    x, v, i, step, rows = 0.0, 0.0, 0.0, 1 / RATE / STEPS, []
    for k, u in enumerate(volts):
        rows.append((u, x, (4.0 * i - 0.6 * v - 40.0 * x) / 0.25))
        rise = (volts[min(k + 1, SAMPLES - 1)] - u) / STEPS
        for part in range(STEPS):
            i += step * (u + rise * part - 1.0 * i - 4.0 * v) / 0.1
            v += step * (4.0 * i - 0.6 * v - 40.0 * x) / 0.25
            x += step * v
    return np.array(rows) + (0.0, 2e-6, 0.02) * generator.standard_normal((SAMPLES, 3))


def _named(rows: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(UNITS, rows.T, strict=True))


def _opened(folder: Path, lost: np.ndarray, columns: tuple[int, ...]) -> Bench:
    tables = []
    for seed in (1, 2):
        rows = _moved(seed).copy()
        rows[np.ix_(lost, columns)] = np.nan
        tables.append(_named(rows))
    return open_bench(studied(folder, COIL, tables[:1], tables[1:], UNITS, rates=[RATE] * 2))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return _opened(tmp_path_factory.mktemp("whole"), np.array([], np.int64), (0,))


@pytest.mark.parametrize(
    ("lost", "columns"),
    [
        pytest.param(np.arange(300, 2300, 200), (0, 1, 2), id="single rows"),
        pytest.param(np.arange(300, 2300, 200), (0,), id="single inputs"),
        pytest.param(np.arange(800, 840), (0, 1, 2), id="a third of a second"),
        pytest.param(np.arange(800, 840), (1,), id="a third of a second of the motion alone"),
    ],
)
def test_lost_rows_do_not_raise_the_error(
    tmp_path: Path, whole: Bench, lost: np.ndarray, columns: tuple[int, ...]
) -> None:
    found = _opened(tmp_path, lost, columns)

    assert found.data.along_motion
    assert found.base.held_out_error < 1.1 * whole.base.held_out_error
    assert found.base.train.values()["k"] == pytest.approx(40.0, rel=0.01)
    counted = [
        np.isfinite(bench.data.held_out.outputs).all(axis=1).mean() for bench in (whole, found)
    ]
    assert counted[1] > 0.9 * counted[0]


def test_a_machine_that_does_not_move_is_no_recording_of_its_motion(tmp_path: Path) -> None:
    still, moving = _moved(2).copy(), _named(_moved(1))
    still[:, 1:] = (1e-6, 0.02) * np.random.default_rng(3).standard_normal((SAMPLES, 2))
    study = studied(tmp_path, COIL, [_named(still)], [moving], UNITS, rates=[RATE] * 2)
    study = with_healthy(study, moving, UNITS, RATE)

    with pytest.raises(ModelError, match="train: found no sample that counts along"):
        open_bench(study)
