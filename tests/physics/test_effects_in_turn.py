"""Effects that a signal passes in turn: their order, and what arrives at one that remembers."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose, signal_order
from rigwatch.physics.engine.fit.recorded_effect_states import RecordedEffectStates

MODEL = shipped_models()["motor"]
TAU, LIMIT, COMMAND, DT = 0.05, 4.0, 10.0, 0.01
VALUES = {"drive_lag_tau": TAU, "drive_saturation_us": LIMIT, "drive_saturation_w": 1.0}


def placed(name: str) -> Placement:
    return Placement(name, library()[name], "drive")


LAG, CLIPS = placed("lag"), placed("saturation")
AHEAD = replace(CLIPS, ahead=True)


def led(*placements: Placement) -> np.ndarray:
    """What the lag holds after a step of the command, as the inputs lead it there."""
    system = compose(MODEL, placements)
    parameters = compile_system(system).vector(VALUES)
    inputs = np.full((100, 1), COMMAND)
    recall = RecordedEffectStates(
        system, inputs, np.zeros((100, len(system.states))), DT, parameters
    )
    (column,) = recall.columns
    return recall.at(parameters)[column]


def test_an_effect_ahead_is_passed_before_those_placed_earlier():
    assert signal_order([LAG, CLIPS], "drive") == [LAG, CLIPS]
    assert signal_order([LAG, AHEAD], "drive") == [AHEAD, LAG]
    assert signal_order([LAG, AHEAD], "shaft") == []


def test_a_system_depends_on_the_order_and_not_on_when_an_effect_was_placed():
    behind, ahead, first = (
        compose(MODEL, placements).ports["drive"]
        for placements in ([LAG, CLIPS], [LAG, AHEAD], [CLIPS, LAG])
    )
    assert ahead == first
    assert behind != first


@pytest.mark.parametrize(
    ("placements", "arrives"),
    [((LAG, CLIPS), COMMAND), ((LAG, AHEAD), LIMIT), ((CLIPS, LAG), LIMIT)],
)
def test_a_lag_remembers_what_the_effects_before_it_let_through(placements, arrives):
    time = DT * np.arange(100)
    assert led(*placements) == pytest.approx(arrives * (1 - np.exp(-time / TAU)), abs=0.02)


def test_what_follows_another_memory_is_not_led_by_the_inputs_alone():
    system = compose(MODEL, (LAG, placed("rate_limit")))
    inputs = np.full((100, 1), COMMAND)
    recall = RecordedEffectStates(
        system, inputs, np.zeros((100, len(system.states))), DT, compile_system(system).parameters
    )
    names = list(system.states)
    assert [names[column] for column in recall.exact] == ["drive_lag_z"]
