"""Parameters that are known of each recording: a load that was changed between two runs."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.study.creation import create
from tests.workbench.machine import recorded

SLED = """
name = "sled"
summary = "A mass that is pushed, with a load on it that is changed between recordings."
inputs.push = { unit = "N", hold = "zero" }
states.v = { unit = "m/s", derivative = "(push - c*v + load)/(m0 + m)", measured = "v" }
parameters.m0 = { value = 1.0, unit = "kg", low = 0.1, high = 10.0 }
parameters.m = { value = 0.0, unit = "g" }
parameters.c = { value = 1.0, unit = "N*s/m" }
outputs.v = { unit = "m/s", expression = "v" }
[ports.load]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"push": "N", "v": "m/s"}
LOADS = {"empty": 0.0, "half": 0.5, "full": 1.5}


def pushed(seed: int, load: float, samples: int = 2000) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)
    push = np.repeat(6 * generator.normal(size=samples // 50), 50)
    v = np.zeros(samples)
    for i in range(1, samples):
        v[i] = v[i - 1]
        for _ in range(5):
            rest = 2.0 * v[i] + 1.5 * np.tanh(v[i] / 0.02)
            v[i] += 0.002 * (push[i - 1] - rest) / (2.0 + load)
    return {"push": push, "v": v + 0.005 * generator.normal(size=samples)}


def template(folder: Path, given: str = "m") -> Path:
    (folder / "model.toml").write_text(SLED)
    text = 'model = "model.toml"\n'
    for seed, (name, load) in enumerate(LOADS.items()):
        recorded(folder / f"{name}.mcap", pushed(seed, load), UNITS)
        use = "held_out" if name == "half" else "train"
        text += f'[[{use}]]\nsession = "{name}.mcap"\nparameters = {{ {given} = {1e3 * load} }}\n'
    path = folder / "template.toml"
    path.write_text(text)
    return path


def test_what_is_known_of_a_recording_counts_in_it_alone(tmp_path: Path) -> None:
    found = explain(create(tmp_path / "study", template(tmp_path)))
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "coulomb")
    assert found.ranking[0].held_out_error < 0.01
    assert "m" not in found.comparison.parameters


def test_a_parameter_that_the_model_does_not_have_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'mass'.*parameters of the model: m0, m, c"):
        create(tmp_path / "study", template(tmp_path, "mass"))
