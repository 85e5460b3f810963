"""Faults of the sensor whose motion drives the model: undone in what was read, and named."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.data.signals import MotionSensor
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.explanation import explanation
from rigwatch.workbench.explain.motion_sensor import DIRECTIONS, corrected
from rigwatch.workbench.report.text_report import doubt_of
from tests.workbench.rigs import test_foreign_rig as rig

_recorded = rig.recorded
SENSOR = MotionSensor("position_sensor", 1, 2)
TIME = np.arange(2048) / 1024
TRUE = np.sin(2 * np.pi * TIME), 2 * np.pi * np.cos(2 * np.pi * TIME)


@pytest.mark.parametrize(
    ("effect", "strength", "x", "v"),
    [
        ("gain", 0.2, TRUE[0] / 0.8, TRUE[1] / 0.8),
        ("offset", 0.3, TRUE[0] + 0.3, TRUE[1]),
        ("drift", 0.3, TRUE[0] + 0.3 * TIME, TRUE[1] + 0.3),
        ("lag", 1e-3, np.sin(2 * np.pi * (TIME - 1e-3)),
         2 * np.pi * np.cos(2 * np.pi * (TIME - 1e-3))),
    ],
)  # fmt: skip
def test_a_fault_is_undone_in_position_and_speed(
    effect: str, strength: float, x: np.ndarray, v: np.ndarray
) -> None:
    read = Recording(1 / 1024, np.stack([np.zeros_like(x), x, v], axis=1), np.zeros((2048, 1)))

    found = corrected(read, SENSOR, DIRECTIONS[effect], strength)

    assert found.inputs[5:-5, 1] == pytest.approx(TRUE[0][5:-5], abs=1e-4)
    assert found.inputs[5:-5, 2] == pytest.approx(TRUE[1][5:-5], abs=2e-3)


@pytest.mark.nightly
def test_gain_of_the_position_sensor_is_named_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = rig.recorded("none")
    read = replace(whole, outputs=whole.outputs * [1.08, 1.0])
    monkeypatch.setattr(rig, "recorded", lambda case: read if case == "none" else _recorded(case))
    bench = rig.bench("none")

    rows, verdict = ranking(bench)

    assert verdict.best is not None
    assert verdict.best is rows[0]
    assert verdict.best.label == "gain@position_sensor"
    assert verdict.best.start["g"] == pytest.approx(1.08, rel=0.03)
    told = explanation(bench, rows, verdict)
    cases, wrong = told.like_this
    assert cases
    assert told.wrong_probability == pytest.approx((wrong + 1) / (cases + 2))
    assert f"of {cases} similar simulated cases {wrong} w" in doubt_of(told)
