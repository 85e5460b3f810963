"""Parameters that the model fits per recording: a table whose tilt differs between recordings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study import Study, open_study
from rigwatch.workbench.study.creation import create
from tests.workbench.machine import Table, recorded

SLED = """
name = "sled"
summary = "A mass that is pushed on a table whose tilt differs between recordings."
inputs.push = { unit = "N", hold = "zero" }
states.v = { unit = "m/s", derivative = "(push - c*v + tilt + load)/m", measured = "v" }
parameters.m = { value = 1.0, unit = "kg", low = 0.1, high = 10.0 }
parameters.c = { value = 1.0, unit = "N*s/m" }
parameters.tilt = { value = 0.0, unit = "mN", per_recording = true }
outputs.v = { unit = "m/s", expression = "v" }
[ports.load]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""
DAMPER = """
name = "damper"
summary = "Force of a damper; the zero of its load cell moves between recordings."
inputs.v = { unit = "m/s" }
parameters.c = { value = 1.0, unit = "N*s/m" }
parameters.zero = { value = 0.0, unit = "N", per_recording = true }
outputs.force = { unit = "N", expression = "c*v + zero - rod" }
[ports.rod]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""
TILTS = {"a": -1.6, "b": 1.1, "c": 2.3, "d": -2.4}
NOISE = 0.005


def pushed(seed: int, tilt: float, friction: float, samples: int = 2000) -> dict[str, np.ndarray]:
    """Motion with Karnopp's stick, solved with Heun's method."""
    generator = np.random.default_rng(seed)
    push = np.repeat(6 * generator.normal(size=samples // 50), 50)
    v = np.zeros(samples)

    def rate(u: float, speed: float) -> float:
        drive = u + tilt - 2.0 * speed
        return (drive - friction * np.sign(speed)) / 2.0

    for i in range(1, samples):
        speed = v[i - 1]
        for _ in range(10):
            if abs(speed) < 1e-9 and abs(push[i - 1] + tilt) <= friction:
                continue
            start = speed or 1e-9 * np.sign(push[i - 1] + tilt)
            guess = start + 1e-3 * rate(push[i - 1], start)
            new = start + 5e-4 * (rate(push[i - 1], start) + rate(push[i - 1], guess))
            speed = 0.0 if new * start < 0 else new
        v[i] = speed
    return {"push": push, "v": v + NOISE * generator.normal(size=samples)}


def sled(folder: Path, model: str = SLED, friction: float = 1.5) -> Path:
    (folder / "model.toml").write_text(model)
    text = 'model = "model.toml"\n'
    for seed, (name, tilt) in enumerate(TILTS.items()):
        recorded(folder / f"{name}.mcap", pushed(seed, tilt, friction), {"push": "N", "v": "m/s"})
        text += f'[[{"held_out" if name in "bd" else "train"}]]\nsession = "{name}.mcap"\n'
    (folder / "template.toml").write_text(text)
    return folder / "template.toml"


@pytest.mark.nightly
def test_a_tilt_that_moves_is_fitted_per_recording_and_friction_is_named(tmp_path: Path) -> None:
    found = explain(create(tmp_path / "study", sled(tmp_path)))
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "coulomb")
    assert found.ranking[0].held_out_error < 1.5 * NOISE
    assert found.ranking[0].parameters["Fc"].value == pytest.approx(1.5, abs=0.1)


def test_the_values_of_held_out_recordings_are_from_openings_that_do_not_count(
    tmp_path: Path,
) -> None:
    study = create(tmp_path / "study", sled(tmp_path, friction=0.0))
    bench = open_bench(study)
    values = bench.base.train.values()
    for name, tilt in TILTS.items():
        assert values[f"tilt_{name}"] == pytest.approx(tilt, abs=0.1)
    assert "tilt_b" not in bench.base.compiled.system.free
    assert bench.base.held_out_error < 1.2 * NOISE
    assert bench.data.openings is not None
    assert len(bench.data.openings) % (2 * bench.data.horizon) == 0
    assert len(bench.data.openings) + len(bench.data.held_out) <= 4000
    assert any("determine what moves" in remark for remark in bench.data.remarks)


def test_without_the_key_the_fit_is_bad(tmp_path: Path) -> None:
    template = sled(tmp_path, SLED.replace(", per_recording = true", ""), friction=0.0)
    bench = open_bench(create(tmp_path / "study", template))
    assert bench.base.held_out_error > 5 * NOISE


def test_counted_samples_do_not_move_what_the_opening_determines(tmp_path: Path) -> None:
    """A held-out recording whose tilt changes after its first part is judged badly."""
    (tmp_path / "model.toml").write_text(SLED)
    text = 'model = "model.toml"\n'
    for name, use in (("a", "train"), ("c", "train"), ("b", "held_out")):
        table = pushed(ord(name), TILTS[name], 0.0)
        if use == "held_out":
            other = pushed(ord(name), TILTS[name] + 3.0, 0.0)
            table["v"][600:] = other["v"][600:]
        recorded(tmp_path / f"{name}.mcap", table, {"push": "N", "v": "m/s"})
        text += f'[[{use}]]\nsession = "{name}.mcap"\n'
    (tmp_path / "template.toml").write_text(text)
    bench = open_bench(create(tmp_path / "study", tmp_path / "template.toml"))
    assert bench.base.train.values()["tilt_b"] == pytest.approx(TILTS["b"], abs=0.1)
    assert bench.base.held_out_error > 5 * NOISE


def stroked(seed: int, zero: float) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)
    time = np.arange(3000) / 100
    v = np.sin(2 * np.pi * 0.7 * time) + 0.6 * np.sin(2 * np.pi * 0.23 * time + seed)
    force = 3.0 * v + zero + 0.8 * np.clip(v / 1e-3, -1, 1)
    return {"v": v, "force": force + 0.02 * generator.normal(size=len(v))}


def damper(folder: Path, table: Callable[..., Table], names: str = "abcd", keys: str = "") -> Study:
    """The study of a damper whose load cell's zero moves; b and d are held out."""
    (folder / "model.toml").write_text(DAMPER)
    text = f'model = "model.toml"\n{keys}'
    for seed, name in enumerate(names):
        log = table(seed, TILTS[name])
        recorded(folder / f"{name}.mcap", log, {"v": "m/s", "force": "N"})
        text += f'[[{"held_out" if name in "bd" else "train"}]]\nsession = "{name}.mcap"\n'
    (folder / "template.toml").write_text(text)
    return create(folder / "study", folder / "template.toml")


def test_a_model_without_states_may_move_too(tmp_path: Path) -> None:
    found = explain(damper(tmp_path, stroked))
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "coulomb")
    assert found.ranking[0].held_out_error < 0.03


def slid(seed: int, zero: float) -> dict[str, np.ndarray]:
    """`stroked` with a slider on a spring in place of dry friction."""
    table = stroked(seed, zero)
    v, spring = table["v"], np.zeros(len(table["v"]))
    for i in range(1, len(v)):
        spring[i] = np.clip(spring[i - 1] + 0.01 * (v[i] + v[i - 1]) / 2 / 0.05, -1, 1)
    friction = spring - np.clip(v / 1e-3, -1, 1)
    return {"v": v, "force": table["force"] + 0.8 * friction}


@pytest.mark.nightly
def test_an_effect_with_memory_is_fitted_where_a_zero_moves(tmp_path: Path) -> None:
    """Its states run through whole recordings, and through the opening of the one held out."""
    found = explain(damper(tmp_path, slid, "acb", "[thin]\nfactor = 7\nedge = 15\n"))
    assert found.verdict == "missing_effect"
    assert found.ranking[0].effect in {"jenkins", "bouc_wen"}, "sharp, they are one law"
    assert found.ranking[0].held_out_error < 0.03


def test_parts_of_one_session_share_a_value(tmp_path: Path) -> None:
    template = sled(tmp_path, friction=0.0)
    text = 'model = "model.toml"\n'
    text += '[[train]]\nsession = "a.mcap"\nend = 14.0\n'
    text += '[[held_out]]\nsession = "a.mcap"\nstart = 14.0\n'
    template.write_text(text)
    bench = open_bench(create(tmp_path / "study", template))
    assert bench.data.openings is None
    assert bench.base.held_out_error < 1.2 * NOISE


def test_a_value_given_in_every_recording_is_known_and_in_some_is_refused(tmp_path: Path) -> None:
    template = sled(tmp_path, friction=0.0)
    lines = template.read_text()
    for name, tilt in TILTS.items():
        known = f'session = "{name}.mcap"\nparameters = {{ tilt = {1e3 * tilt} }}'
        lines = lines.replace(f'session = "{name}.mcap"', known)
    template.write_text(lines)
    study = create(tmp_path / "study", template)
    assert "tilt" in study.model.inputs
    assert open_bench(study).base.held_out_error < 1.2 * NOISE
    file = tmp_path / "study" / "study.toml"
    file.write_text(file.read_text().replace("parameters = { tilt = 1100.0 }", ""))
    with pytest.raises(ConfigError, match=r"held_out\[0\].parameters: found no tilt, expected it"):
        open_study(tmp_path / "study")


def test_fixed_and_per_recording_exclude_each_other(tmp_path: Path) -> None:
    template = sled(
        tmp_path, SLED.replace("per_recording = true", "per_recording = true, fixed = true")
    )
    with pytest.raises(ModelError, match=r"parameters.tilt: found per_recording and fixed"):
        create(tmp_path / "study", template)
