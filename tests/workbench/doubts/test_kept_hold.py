"""A hold does not stand for a missing effect: steps are seen to be held, and it is chosen anew."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import Input, parse_model
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.fit.input_hold import stepped, with_hold
from rigwatch.workbench.steps.trial import try_add
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tests.workbench.machine import studied

BLOCK = """
name = "block"
summary = "A block and its slow thermometer."
inputs.power = { unit = "W" }
states.T = { unit = "K", derivative = "(g*power - T)/rise", measured = "warmer" }
parameters.g = { value = 1.0, unit = "K/W", low = 0.0 }
parameters.rise = { value = 25.0, unit = "s", low = 1.0 }
outputs.warmer = { unit = "K", expression = "T" }
ports.meter = { kind = "sensor", signal = "warmer" }
"""
SLOW, BLOCK_TIME, SAMPLES = 2.0, 20.0, 400


def run(seed: int, steady: int, slow_s: float = SLOW, late: float = 0.0) -> dict[str, np.ndarray]:
    """Power held for some seconds at a time, and the thermometer's reading, both exact.

    `late` is the share of a sample after which the power follows what is logged.
    """
    draw = np.random.default_rng(seed)
    power = np.repeat(draw.uniform(0, 100, SAMPLES // steady + 1), steady)[:SAMPLES]
    block = read = before = 0.0
    told = []
    for held in power:
        told.append(read)
        for acting, seconds in ((before, late), (held, 1.0 - late)):
            own, slow = np.exp(-seconds / BLOCK_TIME), np.exp(-seconds / slow_s)
            gap, carried = block - acting, (own - slow) / (1 - slow_s / BLOCK_TIME)
            read = acting + carried * gap + slow * (read - acting)
            block = acting + own * gap
        before = held
    return {"power": power, "warmer": np.array(told) + draw.normal(0, 0.05, SAMPLES)}


def test_a_hold_is_chosen_anew_with_the_slow_sensor_in_the_model(tmp_path):
    made = studied(
        tmp_path, BLOCK, [run(1, 6, late=0.6)], [run(2, 6, late=0.6)],
        {"power": "W", "warmer": "K"}, rates=[1.0, 1.0],
    )  # fmt: skip
    trial = try_add(made, "lag")
    assert trial.change.before.hold["power"].late == 0.0
    assert trial.after.file.hold == {"power": "zero"}
    assert trial.after.file.late == {"power": pytest.approx(0.6, abs=0.05)}
    assert trial.change.after.held_out_error < 0.06


def chosen(steady: int, **more: float) -> Input:
    """The input as it is taken between samples."""

    def recording(seed: int) -> Recording:
        table = run(seed, steady, **more)
        return Recording(1.0, table["power"][:, None], table["warmer"][:, None])

    span = (Span(session="simulated"),)
    file = StudyFile(model="block.toml", train=span, held_out=span)
    study = Study(Path(), file, parse_model(BLOCK, Path("block.toml")), library(), frozenset())
    data = Data(recording(1), recording(2), None, 40, ())
    return with_hold(study, data).model.inputs["power"]


def test_steps_are_held_though_the_model_is_far_off():
    assert chosen(40).hold == "zero"


@pytest.mark.parametrize("slow_s", [1.0, 2.0])
def test_a_slow_sensor_makes_no_input_late(slow_s):
    assert (chosen(6, slow_s=slow_s).hold, chosen(6, slow_s=slow_s).late) == ("zero", 0.0)


def test_an_input_that_acts_late_is_late():
    found = chosen(6, slow_s=1e-3, late=0.6)
    assert (found.hold, found.late) == ("zero", pytest.approx(0.6, abs=0.02))


TIME = np.arange(300) / 100


@pytest.mark.parametrize(
    ("signal", "held"),
    [
        (np.repeat([0.0, 1.0, -0.4], 100), True),
        (np.concatenate([np.zeros(50), np.ones(150), np.linspace(1, 0, 100)]), True),
        (np.sin(TIME), False),
        (np.round(40 * np.sin(TIME)) / 40, False),
        (np.repeat([0.0, 1.0, -0.4], 100) + 1e-3 * np.sin(40 * TIME), False),
        (np.ones(300), False),
    ],
    ids=["steps", "step and ramp", "sine", "coarse sine", "measured steps", "constant"],
)
def test_a_signal_is_seen_to_be_held_by_its_steps(signal, held):
    assert stepped(signal) is held
