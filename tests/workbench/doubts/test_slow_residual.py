"""A heated block whose residual is so slow that no score is significant: held-out data decide."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.ranking import Ranked, select_for_fit
from tests.workbench.machine import studied

BLOCK = """
name = "block"
summary = "A block with a heater on a base."
hold = "zero"
inputs.power = { unit = "W" }
inputs.room = { unit = "K" }
parameters.C = { value = 500.0, unit = "J/K", low = 1.0 }
parameters.Cb = { value = 2000.0, unit = "J/K", low = 10.0 }
parameters.G = { value = 1.0, unit = "W/K", low = 0.0 }
parameters.Gb = { value = 1.0, unit = "W/K", low = 0.0 }
parameters.Ga = { value = 0.5, unit = "W/K", low = 0.0 }
outputs.block = { unit = "degC", expression = "T" }
[states.T]
unit = "K"
derivative = "(heater - G*(T - room) - Gb*(T - Tb) + loss)/C"
measured = "block"
[states.Tb]
unit = "K"
derivative = "(Gb*(T - Tb) - Ga*(Tb - room))/Cb"
start = 293.0
[ports.heater]
kind = "actuator"
signal = "power"
[ports.loss]
kind = "force"
unit = "W"
variables.T = { expression = "T", unit = "K" }
variables.Ta = { expression = "room", unit = "K" }
[ports.thermocouple]
kind = "sensor"
signal = "block"
"""
UNITS = {"power": "W", "room": "K", "block": "degC"}
CAPACITY, BASE, LOSS, STILL, TO_BASE, OF_BASE = 530.0, 1950.0, 0.9, 0.29, 0.56, 0.6
WELL = 25.0
"""Time constant of the thermocouple in its well [s]."""
EVERY, STEPS, SAMPLES, NOISE = 2.0, 20, 1600, 0.08


def block(seed: int) -> dict[str, np.ndarray]:
    """Euler steps of a tenth of a second; the heater is switched every few minutes."""
    draw = np.random.default_rng(seed)
    power = np.concatenate([
        np.full(draw.integers(30, 200), draw.uniform(0, 400)) for _ in range(SAMPLES // 30)
    ])[:SAMPLES]  # fmt: skip
    power[:10] = 0.0
    room = 293.15 + np.sin(np.arange(SAMPLES) * EVERY / 1500 + seed)
    warm = base = read = room[0]
    shown = np.empty(SAMPLES)
    for row in range(SAMPLES):
        shown[row] = read
        for _ in range(STEPS):
            above, to_base = warm - room[row], TO_BASE * (warm - base)
            loss = LOSS * above + STILL * np.abs(above) ** 0.25 * above
            warm += EVERY / STEPS * (power[row] - loss - to_base) / CAPACITY
            base += EVERY / STEPS * (to_base - OF_BASE * (base - room[row])) / BASE
            read += EVERY / STEPS * (warm - read) / WELL
    return {
        "power": power,
        "room": room,
        "block": shown - 273.15 + NOISE * draw.normal(size=SAMPLES),
    }


@pytest.mark.nightly
def test_a_late_thermocouple_is_found_by_the_recordings_held_out(tmp_path: Path) -> None:
    study = studied(
        tmp_path, BLOCK, [block(2), block(3)], [block(4)], UNITS, "horizon = 320.0", [0.5] * 3
    )
    found = explain(study)
    best = found.ranking[0]
    assert best.effect == "lag"
    one_transfer_function = {f"lag@{best.port}", *best.class_}
    assert "lag@thermocouple" in one_transfer_function, "late at its heater it reads the same"
    assert "free_convection@loss" in found.beside, "still air carries heat off as well"
    assert 0.8 * WELL < best.parameters["tau"].value < 1.2 * WELL


@pytest.mark.parametrize(
    ("far", "significant", "fitted"),
    [
        pytest.param(True, 1.0, ["lag@thermocouple", "rate_limit@heater"], id="far from noise"),
        pytest.param(False, 1.0, [], id="near it"),
        pytest.param(True, 1e-3, ["radiation@loss"], id="another is significant"),
    ],
)
def test_what_explains_much_is_fitted_where_nothing_is_significant(
    *, far: bool, significant: float, fitted: list[str]
) -> None:
    shares = {
        ("lag", "thermocouple"): (0.45, "sensor", 0.6),
        ("rate_limit", "heater"): (0.30, "actuator", 0.6),
        ("curvature", "thermocouple"): (0.20, "sensor", 0.6),
        ("radiation", "loss"): (0.02, "force", significant),
    }
    rows = []
    for (name, port), (share, kind, p_alone) in shares.items():
        placed = Placement(name, library()[name], port)
        rows.append(Ranked(placed, kind, 1.0, share, {}, [], {}, {}, p_alone=p_alone))
    chosen = select_for_fit(rows, "dynamic", at_floor=False, far=far)
    assert [row.label for row in chosen] == fitted
    assert [row.label for row in rows if row.likely] == fitted
