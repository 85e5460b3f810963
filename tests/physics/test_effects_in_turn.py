"""Effects that a signal passes in turn: their order, and what arrives at one that remembers."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose, signal_order, units_at
from rigwatch.physics.engine.fit.recorded_effect_states import RecordedEffectStates
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.elements import with_element

MODEL = shipped_models()["motor"]
TAU, LIMIT, COMMAND, DT = 0.05, 4.0, 10.0, 0.01
SPACING = np.full(100, DT)
TIMES = DT * np.arange(100)
VALUES = {"drive_lag_tau": TAU, "drive_saturation_us": LIMIT, "drive_saturation_w": 1.0}


def placed(name: str) -> Placement:
    return Placement(name, library()[name].at(units_at(MODEL, "drive"), name), "drive")


LAG, CLIPS = placed("lag"), placed("saturation")
AHEAD = replace(CLIPS, ahead=True)


def led(*placements: Placement) -> np.ndarray:
    """What the lag holds after a step of the command, as the inputs lead it there."""
    system = compose(MODEL, placements)
    parameters = compile_system(system).vector(VALUES)
    inputs = np.full((100, 1), COMMAND)
    recall = RecordedEffectStates(
        system, inputs, np.zeros((100, len(system.states))), TIMES, SPACING, parameters
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
        system, inputs, np.zeros((100, len(system.states))), TIMES, SPACING,
        compile_system(system).parameters,
    )  # fmt: skip
    names = list(system.states)
    assert [names[column] for column in recall.exact] == ["drive_lag_z"]


def moved(model, *placements: Placement) -> np.ndarray:
    """The outputs after a step of the command that the drive clips; gentle lag and limit."""
    compiled = compile_system(compose(model, placements))
    values = {**VALUES, **{f"healthy_{name}": value for name, value in VALUES.items()}}
    known = {n: v for n, v in values.items() if n in compiled.system.parameters}
    inputs = COMMAND * np.sin(np.linspace(0, 12, 100))[:, None]
    return compiled.simulate(
        inputs, DT, np.zeros(1, np.int64), 100, substeps=8,
        initial=np.zeros((1, len(compiled.system.states))), parameters=compiled.vector(known),
    ).outputs  # fmt: skip


def test_an_effect_lies_on_either_side_of_an_element():
    clipping = with_element(MODEL, CLIPS)
    before, beyond = moved(clipping, LAG), moved(clipping, replace(LAG, beyond="saturation"))
    assert before == pytest.approx(moved(MODEL, LAG, CLIPS), rel=1e-9)
    assert beyond == pytest.approx(moved(MODEL, CLIPS, LAG), rel=1e-9)
    assert np.abs(before - beyond).max() > 0.01 * np.abs(before).max()


def test_two_elements_are_passed_in_order():
    slow = with_element(with_element(MODEL, LAG), CLIPS)
    gain = replace(placed("gain"), beyond="saturation")
    both = compose(slow, (gain,))
    assert "drive_beyond_lag" in both.ports
    assert moved(slow) == pytest.approx(moved(MODEL, CLIPS, LAG), rel=1e-9)
    assert moved(slow, gain) == pytest.approx(moved(MODEL, CLIPS, placed("gain"), LAG), rel=1e-9)


def test_an_element_that_the_model_does_not_have_is_told():
    with pytest.raises(ModelError, match="an element of the base at drive: saturation"):
        compose(with_element(MODEL, CLIPS), (replace(LAG, beyond="backlash"),))
    with pytest.raises(ModelError, match="an element of the base at drive: none"):
        compose(MODEL, (replace(LAG, beyond="saturation"),))
