"""Intervals hold what is taken for known; a short healthy recording says what it leaves open."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.workbench.compare.compare import Comparison, compare
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import Table, recorded, studied

MODEL = """
name = "slide"
summary = "A mass with drag that a force pushes; its speed is measured."
inputs.u = { unit = "N", hold = "zero" }
states.v = { unit = "m/s", derivative = "(g*u - c*v + load)/m", measured = "v" }
parameters.m = { value = 1.0, unit = "kg", DEVIATION fixed = true }
parameters.c = { value = 1.0, unit = "N s/m", low = 0.0, fixed = true, kept = true }
parameters.g = { value = 1.0, unit = "1", kept = true, fixed = true }
outputs.v = { unit = "m/s", expression = "v" }
[ports.load]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""
UNITS = {"u": "N", "v": "m/s"}
EFFECT = '\n[[effects]]\neffect = "coulomb"\nport = "load"\nparameters = { Fc = 0.2 }\n'


def run(seed: int, friction: float, samples: int, noise: float = 0.002) -> Table:
    generator = np.random.default_rng(seed)
    u = np.repeat(2 * generator.normal(size=samples // 25), 25)
    v = np.zeros(samples)
    for i in range(1, samples):
        v[i] = v[i - 1]
        for _ in range(10):
            v[i] += 0.001 * (u[i - 1] - 0.8 * v[i] - friction * np.tanh(v[i] / 0.002))
    return {"u": u, "v": v + noise * generator.normal(size=samples)}


def compared(folder: Path, healthy: Table, deviation: str) -> Comparison:
    """A study of rubbing recordings with friction in its model, told by a healthy recording."""
    model = MODEL.replace("DEVIATION", deviation)
    study = studied(folder, model, [run(0, 0.3, 1000)], [run(1, 0.3, 1000)], UNITS)
    recorded(folder / "healthy.mcap", healthy, UNITS)
    with (study.folder / "study.toml").open("a") as file:
        file.write('[[healthy]]\nsession = "../healthy.mcap"\n' + EFFECT)
    return compare(open_study(study.folder))


def test_a_strength_is_no_better_known_than_the_mass_it_is_told_by(tmp_path: Path) -> None:
    widths = []
    for name, deviation in (("known", ""), ("vague", "deviation = 0.1,")):
        found = compared(tmp_path / name, run(2, 0.0, 1000), deviation)
        friction = found.parameters["load_coulomb_Fc"]
        assert friction.value == pytest.approx(0.3, rel=0.05)
        assert friction.interval is not None
        widths.append((friction.interval[1] - friction.interval[0]) / 2 / friction.value)
    assert widths[0] < 0.1
    # A mass that is off by a tenth makes every force so.
    assert widths[1] == pytest.approx(1.96 * 0.1, rel=0.2)


def test_a_healthy_recording_says_what_it_leaves_open(tmp_path: Path) -> None:
    told = compared(tmp_path / "long", run(2, 0.0, 1000), "")
    assert not any("of its value only" in remark for remark in told.remarks)

    vague = compared(tmp_path / "short", run(2, 0.0, 200, noise=0.5), "")
    said = [
        remark for remark in vague.remarks if "the healthy recording of 2 s determines c" in remark
    ]
    assert said
    assert "s of such a motion would determine" in said[0]
