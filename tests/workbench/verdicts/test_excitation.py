"""Training that does not excite the model is reported before a ranking, with a better split."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.explain.adequacy import unexcited
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.creation import create
from tests.workbench.machine import recorded, studied
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS

MOTOR = (Path(str(files("rigwatch"))) / "physics" / "models" / "motor.toml").read_text()


def motor(levels: list[float], seed: int = 0, each: int = 200) -> dict[str, np.ndarray]:
    """Speed of a motor at rest and after steps of its voltage, two seconds each."""
    u = np.repeat(levels, each)
    u = u + 1e-3 * np.random.default_rng(seed + 9).normal(size=len(u))
    v = np.zeros(len(u))
    for i in range(1, len(u)):
        v[i] = v[i - 1]
        for _ in range(5):
            v[i] += 0.002 * (-6 * v[i] + 9 * u[i - 1])
    return {"u": u, "v": v + 0.01 * np.random.default_rng(seed).normal(size=len(u))}


def split(folder: Path, table: dict[str, np.ndarray], spans: str) -> str:
    """What `explain` says of one recording in parts."""
    folder.mkdir(exist_ok=True)
    (folder / "model.toml").write_text(SPEED + PORT)
    recorded(folder / "run.mcap", table, UNITS)
    text = f'model = "model.toml"\nhorizon = 0.5\n{spans}'
    (folder / "template.toml").write_text(text)
    found = explain(create(folder / "study", folder / "template.toml"))
    assert found.verdict == "model_inadequate"
    return found.text


def test_a_part_without_motion_is_reported_and_another_split_is_proposed(tmp_path: Path) -> None:
    table = motor([0] * 5 + [1, -1, 0.5, 2, -2, 1, 0.5, -1, 1.5, 0])
    spans = '[[train]]\nsession = "run.mcap"\nend = 10.0\n'
    spans += '[[held_out]]\nsession = "run.mcap"\nstart = 10.0\n'
    said = split(tmp_path, table, spans)
    assert "the training does not excite the model (" in said
    assert "b = " in said
    assert "run.mcap from 0 s to 15 s and hold out ../run.mcap from 15 s to 30 s" in said


def test_steps_without_their_transients_are_reported(tmp_path: Path) -> None:
    table = motor([1, -1, 0.5, 2, -2, 1, 0.5, -1, 1.5, 0.2])
    parts = [(use, 2 * k + 1.0) for k, use in enumerate(["train", "held_out"] * 5)]
    spans = "".join(
        f'[[{use}]]\nsession = "run.mcap"\nstart = {at}\nend = {at + 1}\n' for use, at in parts
    )
    said = split(tmp_path, table, spans)
    assert "a = " in said
    assert "run.mcap from 1 s to 10.5 s and hold out ../run.mcap from 10.5 s to 20 s" in said


def test_training_that_tells_its_model_is_ranked(tmp_path: Path) -> None:
    table = motor([0, 1, -1, 0.5, 2, -2, 1, 0.5, -1, 1.5, 0])
    keys = "horizon = 0.5"
    found = explain(
        studied(tmp_path, SPEED + PORT, [table], [motor([1, -1, 2, 0], 3)], UNITS, keys)
    )
    assert found.verdict == "nothing_missing"


def wound(volts: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """A motor with dry friction, whose winding settles within a sixth of a sample of 5 ms."""
    resistance, inductance, constant, inertia, friction, step = 2.5, 2e-3, 0.06, 9e-5, 0.015, 5e-5
    w = i = 0.0
    speed = np.zeros(len(volts))
    for row, volt in enumerate(volts.tolist()):
        speed[row] = w
        for _ in range(100):
            i = (i + step * (volt - constant * w) / inductance) / (
                1 + step * resistance / inductance
            )
            w += step * constant * i / inertia
            w = float(np.sign(w)) * max(abs(w) - step * friction / inertia, 0.0)
    return {
        "voltage": volts,
        "speed": speed + 0.2 * np.random.default_rng(seed).normal(size=len(volts)),
    }


@pytest.mark.nightly
def test_an_inductance_too_small_to_show_is_no_reason_to_refuse(tmp_path: Path) -> None:
    generator, t = np.random.default_rng(4), 0.005 * np.arange(2600)
    steps = np.repeat(generator.uniform(-10, 10, 60), generator.integers(50, 160, 60))[:2600]
    swings = 3.2 * sum(np.sin(2 * np.pi * f * t + f) for f in (0.27, 0.66, 1.9))
    slow = 6 * np.sin(2 * np.pi * 0.35 * t) + 3 * np.sin(2 * np.pi * 1.7 * t + 1)
    text = MOTOR.replace("value = 1.0", "value = 2.5").replace("value = 0.1", "value = 0.06")
    train, held_out = [wound(steps, 1), wound(swings, 2)], [wound(slow, 3)]
    units, rates = {"voltage": "V", "speed": "rad/s"}, [200.0] * 3
    study = studied(tmp_path, text, train, held_out, units, rates=rates)
    assert unexcited(open_bench(study)) is None


BLOCK = """
name = "block"
summary = "A block that a heater warms."
inputs.u = { unit = "%" }
states.T = { unit = "K", derivative = "(k*heater - (T - Ta))/tau", measured = "T" }
parameters.k = { value = 60.0, unit = "K", low = 0.0 }
parameters.tau = { value = 120.0, unit = "s", low = 5.0 }
parameters.Ta = { value = 21.0, unit = "K" }
outputs.T = { unit = "K", expression = "T" }
[ports.heater]
kind = "actuator"
signal = "u"
[ports.probe]
kind = "sensor"
signal = "T"
"""


def warmed(levels: list[int], counts: list[int], seed: int, begin: float) -> dict[str, np.ndarray]:
    """A block and its slow probe, read every 2 s to half a kelvin; `counts` rows of each level."""
    u = np.repeat(np.array(levels, float), counts)
    block, probe, read = begin, begin, np.zeros(len(u))
    noise = 0.1 * np.random.default_rng(seed).normal(size=len(u))
    for i in range(len(u)):
        read[i] = np.round((probe + noise[i]) / 0.49) * 0.49
        for _ in range(20):
            block += 0.1 * (0.6 * u[i] + 21 - block) / 170
            probe += 0.1 * (block - probe) / 20
    return {"u": u, "T": read}


def test_a_training_too_short_for_every_parameter_says_that_it_cannot_tell(tmp_path: Path) -> None:
    train = warmed([0, 100, 20], [5, 44, 41], seed=0, begin=21.0)
    held_out = warmed([20, 80], [9, 50], seed=1, begin=44.0)
    units = {"u": "%", "T": "K"}
    found = explain(studied(tmp_path, BLOCK, [train], [held_out], units, rates=[0.5, 0.5]))
    assert found.verdict == "model_inadequate"
    assert "determines none of k, tau, Ta" in found.text


CORNER = """
name = "corner"
summary = "A body on a strut, and a wheel that no channel shows."
inputs.u = { unit = "m/s^2" }
states.x = { unit = "m", derivative = "v", measured = "x" }
states.v = { unit = "m/s", derivative = "u - k*x - c*v + load", rate_of = "x" }
states.w = { unit = "m", derivative = "(x - w)/T" }
parameters.k = { value = 80.0, unit = "1/s^2", low = 1.0, high = 1e4 }
parameters.c = { value = 0.5, unit = "1/s", low = 0.0, high = 1e2 }
parameters.T = { value = 0.2, unit = "s", low = 0.01, high = 10.0 }
outputs.x = { unit = "m", expression = "x" }
outputs.a = { unit = "m/s^2", expression = "u - k*x - c*v + load" }
[ports.load]
kind = "force"
unit = "m/s^2"
variables.x = { expression = "x", unit = "m" }
variables.v = { expression = "v", unit = "m/s" }
"""


def driven(seed: int) -> dict[str, np.ndarray]:
    """The body shaken by a smooth force; semi-implicit steps of 0.5 ms."""
    generator = np.random.default_rng(seed)
    time = np.arange(20 * 2000) / 2000
    u = sum(np.sin(2 * np.pi * f * time + generator.uniform(0, 6)) for f in (0.6, 1.1, 1.7, 2.9))
    x, v, found = 0.0, 0.0, np.zeros((len(time), 2))
    for step, push in enumerate(u):
        a = push - 100.0 * x - 0.8 * v
        found[step] = x, a
        v += 5e-4 * a
        x += 5e-4 * v
    kept = found[::20] + generator.normal(size=(len(time) // 20, 2)) * [2e-5, 2e-2]
    return {"u": u[::20], "x": kept[:, 0], "a": kept[:, 1]}


def test_nothing_missing_names_what_the_measured_motion_leaves_unjudged(tmp_path: Path) -> None:
    units = {"u": "m/s^2", "x": "m", "a": "m/s^2"}
    found = explain(studied(tmp_path, CORNER, [driven(0)], [driven(1)], units))
    assert found.verdict == "nothing_missing"
    assert "no output depends on T, which is not judged" in found.text
