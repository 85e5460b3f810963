"""A hold does not stand for a missing effect: steps are seen to be held, and it is chosen anew."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
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


def run(seed: int, steady: int) -> dict[str, np.ndarray]:
    """Power held for some seconds at a time, and the thermometer's reading, both exact."""
    draw = np.random.default_rng(seed)
    power = np.repeat(draw.uniform(0, 100, SAMPLES // steady + 1), steady)[:SAMPLES]
    own, slow = np.exp(-1 / BLOCK_TIME), np.exp(-1 / SLOW)
    carried = (own - slow) / (1 - SLOW / BLOCK_TIME)
    block = read = 0.0
    told = []
    for held in power:
        told.append(read)
        gap = block - held
        read = held + carried * gap + slow * (read - held)
        block = held + own * gap
    return {"power": power, "warmer": np.array(told) + draw.normal(0, 0.05, SAMPLES)}


def test_an_input_is_not_late_once_the_slow_sensor_is_in_the_model(tmp_path):
    made = studied(tmp_path, BLOCK, [run(1, 6)], [run(2, 6)], {"power": "W", "warmer": "K"},
                   rates=[1.0, 1.0])  # fmt: skip
    trial = try_add(made, "lag")
    assert trial.change.before.hold["power"].late > 0.5
    assert (trial.after.file.hold, trial.after.file.late) == ({"power": "zero"}, {})
    assert trial.change.after.held_out_error < 0.06


def test_steps_are_held_though_the_model_is_far_off():
    def recording(seed: int) -> Recording:
        table = run(seed, 40)
        return Recording(1.0, table["power"][:, None], table["warmer"][:, None])

    span = (Span(session="simulated"),)
    file = StudyFile(model="block.toml", train=span, held_out=span)
    study = Study(Path(), file, parse_model(BLOCK, Path("block.toml")), library(), frozenset())
    data = Data(recording(1), recording(2), None, 40, ())
    assert with_hold(study, data).model.held("power") == "zero"


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
