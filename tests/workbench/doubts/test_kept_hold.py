"""A hold does not stand for a missing effect: steps are seen to be held, and it is chosen anew."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import parse_model
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare import with_hold_decided
from rigwatch.workbench.compare.preparation import bench_of, open_bench
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.fit.input_hold import stepped, with_hold
from rigwatch.workbench.ranking import rank
from rigwatch.workbench.steps.trial import try_add
from rigwatch.workbench.study.edits import drop_effect, keep_holds
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

    Each power acts from a part `late` of its second on.
    """
    draw = np.random.default_rng(seed)
    power = np.repeat(draw.uniform(0, 100, SAMPLES // steady + 1), steady)[:SAMPLES]
    block = read = 0.0
    told = []
    for acting, held in zip(np.concatenate([power[:1], power[:-1]]), power, strict=True):
        told.append(read)
        block, read = warmed(block, read, acting, late, slow_s)
        block, read = warmed(block, read, held, 1.0 - late, slow_s)
    return {"power": power, "warmer": np.array(told)}


def warmed(block: float, read: float, held: float, time_s: float, slow_s: float):
    """Block and reading after some time of constant power."""
    own, slow = np.exp(-time_s / BLOCK_TIME), np.exp(-time_s / slow_s)
    carried = (own - slow) / (1 - slow_s / BLOCK_TIME)
    warm = held + (block - held) * own
    return warm, held + (block - held) * carried + (read - held) * slow


def test_an_input_is_not_late_once_the_slow_sensor_is_in_the_model(tmp_path):
    made = studied(tmp_path, BLOCK, [run(1, 6)], [run(2, 6)], {"power": "W", "warmer": "K"},
                   rates=[1.0, 1.0])  # fmt: skip
    trial = try_add(made, "lag")
    assert trial.change.before.hold["power"].late > 0.5
    assert (trial.after.file.hold, trial.after.file.late) == ({"power": "zero"}, {})
    assert trial.change.after.held_out_error < 0.06
    assert trial.after.file.holds_chosen
    undone = drop_effect(trial.after).file
    assert (undone.hold, undone.holds_chosen) == ({}, False)


@pytest.mark.parametrize(
    ("keys", "late"),
    [pytest.param("holds_chosen = true", 0.0, id="chosen"), pytest.param("", 0.95, id="given")],
)
def test_a_hold_that_an_earlier_step_chose_is_chosen_again(
    tmp_path: Path, keys: str, late: float
) -> None:
    hold = 'hold = { power = "zero" }\nlate = { power = 0.95 }\n'
    logs = [[run(seed, 6, slow_s=1.0)] for seed in (1, 2)]
    made = studied(
        tmp_path, BLOCK, *logs, {"power": "W", "warmer": "K"}, hold + keys, rates=[1.0, 1.0]
    )
    bench = open_bench(made)
    rows = rank(bench.study, bench.data, bench.base, bench.floor)
    found = with_hold_decided(bench, rows)
    assert found.bench.study.holds["power"].late == pytest.approx(late, abs=0.05)
    kept = keep_holds(found.bench.study).file
    assert kept.late.get("power", 0.0) == pytest.approx(late, abs=0.05)
    assert kept.holds_chosen == bool(keys)


def test_an_effect_that_the_chosen_hold_stands_for_is_added_with_its_own_hold(
    tmp_path: Path,
) -> None:
    keys = 'hold = { power = "zero" }\nlate = { power = 0.95 }\nholds_chosen = true\n'
    logs = [[run(seed, 6, slow_s=1.0)] for seed in (1, 2)]
    made = studied(tmp_path, BLOCK, *logs, {"power": "W", "warmer": "K"}, keys, rates=[1.0, 1.0])
    trial = try_add(made, "lag", "meter")
    assert trial.change.step == "add"
    assert (trial.after.file.hold, trial.after.file.late) == ({"power": "zero"}, {})
    assert trial.change.after.held_out_error < 0.1 * trial.change.before.held_out_error
    assert trial.after.file.holds_chosen
    (added,) = trial.after.file.effects
    assert added.parameters["tau"] == pytest.approx(1.0, rel=0.1)


def in_memory(steady: int, noise: float = 0.0, **more: float) -> tuple[Study, Data]:
    def recording(seed: int) -> Recording:
        table, draw = run(seed, steady, **more), np.random.default_rng(seed + 100)
        reading = table["warmer"] + noise * draw.normal(size=SAMPLES)
        return Recording(1.0, table["power"][:, None], reading[:, None])

    span = (Span(session="simulated"),)
    file = StudyFile(model="block.toml", train=span, held_out=span)
    study = Study(Path(), file, parse_model(BLOCK, Path("block.toml")), library(), frozenset())
    return study, Data(recording(1), recording(2), None, 40, ())


def test_steps_are_held_though_the_model_is_far_off():
    assert with_hold(*in_memory(40)).model.held("power") == "zero"


def test_a_slow_sensor_that_a_lateness_hid_is_named():
    bench = bench_of(*in_memory(6, slow_s=1.0, late=0.6))
    assert bench.study.holds["power"].late > 0.9
    verdict = ranking(bench)[1]
    assert verdict.word == "missing_effect"
    assert verdict.members[0] in {"lag@meter", "lag@heater"}


def test_a_verdict_that_depends_on_the_hold_is_undetermined_and_says_so():
    verdict = ranking(bench_of(*in_memory(6, noise=0.3, slow_s=0.7, late=0.6)))[1]
    assert verdict.word == "undetermined"
    assert verdict.rivals[-1].startswith("lag@")
    assert " of a sample late explain this recording equally well" in verdict.text


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
