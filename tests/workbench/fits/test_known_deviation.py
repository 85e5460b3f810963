"""Intervals hold what is taken for known; a short healthy recording says what it leaves open."""

import re
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.compare import Comparison, compare
from rigwatch.workbench.compare.preparation import open_bench
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.compare.unweighed import unweighed
from rigwatch.workbench.fit import poorly_determined
from rigwatch.workbench.study.study import Kept, Study
from tests.workbench.machine import Table, studied, with_healthy

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


def compared(folder: Path, healthy: Table, deviation: str, keys: str = "") -> Comparison:
    """A study of rubbing recordings with friction in its model, told by a healthy recording."""
    return compare(rubbing(folder, healthy, deviation, keys))


def rubbing(folder: Path, healthy: Table, deviation: str, keys: str = "") -> Study:
    model = MODEL.replace("DEVIATION", deviation)
    study = studied(folder, model, [run(0, 0.3, 1000)], [run(1, 0.3, 1000)], UNITS, keys)
    return with_healthy(study, healthy, UNITS, keys=EFFECT)


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


def test_a_mass_that_was_weighed_replaces_the_model_files(tmp_path: Path) -> None:
    widths = []
    for name, keys in (
        ("alone", "start = { m = 1.2 }"),
        ("deviation", "start = { m = 1.2 }\ndeviation = { m = 0.012 }"),
    ):
        found = compared(tmp_path / name, run(2, 0.0, 1000), "deviation = 0.3,", keys)
        friction = found.parameters["load_coulomb_Fc"]
        # The recordings show the force for each kilogram.
        assert friction.value == pytest.approx(0.3 * 1.2, rel=0.05)
        assert friction.interval is not None
        widths.append((friction.interval[1] - friction.interval[0]) / 2 / friction.value)
    assert widths[0] < 0.1
    added = np.sqrt(widths[1] ** 2 - widths[0] ** 2)
    assert added == pytest.approx(1.96 * 0.01, rel=0.2)


def test_a_start_does_not_replace_what_the_healthy_recording_shows(tmp_path: Path) -> None:
    study = rubbing(tmp_path, run(2, 0.0, 1000), "", "start = { c = 1.3 }")
    bench = open_bench(study)
    drag, friction = (bench.base.train.values()[name] for name in ("c", "load_coulomb_Fc"))
    assert bench.study.model.parameters["c"].value == pytest.approx(0.8, rel=0.05)
    assert drag == bench.study.model.parameters["c"].value
    assert friction == pytest.approx(0.3, rel=0.05)


def test_a_strength_says_how_it_moves_with_a_mass_that_nobody_weighed(tmp_path: Path) -> None:
    told = []
    for name, keys in (("prior", ""), ("weighed", "start = { m = 1.2 }\ndeviation = { m = 0.1 }")):
        study = rubbing(tmp_path / name, run(2, 0.0, 1000), "deviation = 0.1,", keys)
        bench = open_bench(study)
        more = added_variances(bench.study, bench.data, bench.bare, bench.base)
        told.append(unweighed(bench, bench.base.placements[0], bench.base, more))
    assert len(told[0]) == 1
    assert "Fc of coulomb@load moves by 1 % for each percent of m (" in told[0][0]
    ratio = re.search(r"the recordings alone show (\S+) N per kg \((\S+) … (\S+)\)", told[0][0])
    assert ratio
    value, low, high = map(float, ratio.groups())
    # The mass is uncertain by a tenth, its ratio to the friction is not.
    assert value == pytest.approx(0.3, rel=0.05)
    assert 0 < high - low < 0.2 * value
    assert not told[1]


def test_the_deviation_of_a_parameter_that_is_fitted_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"deviation: found 'c', expected a fixed parameter of"):
        rubbing(tmp_path, run(2, 0.0, 1000), "", "deviation = { c = 0.1 }")


def test_a_healthy_recording_says_what_it_leaves_open(tmp_path: Path) -> None:
    told = compared(tmp_path / "long", run(2, 0.0, 1000), "")
    assert not any("of its value only" in remark for remark in told.remarks)

    vague = compared(tmp_path / "short", run(2, 0.0, 200, noise=0.5), "")
    said = [
        remark for remark in vague.remarks if "the healthy recording of 2 s determines c" in remark
    ]
    assert said
    assert "s of such a motion would determine" in said[0]


def test_a_parameter_that_nothing_determines_has_no_percentage_of_its_own() -> None:
    model = shipped_models()["mass-spring-damper"]
    name = next(iter(model.parameters))
    kept = structs.replace(model.parameters[name], kept=True)
    model = structs.replace(model, parameters={**model.parameters, name: kept})
    (said,) = poorly_determined(Kept((name,), np.array([[1e140]])), model, 3.0)
    assert "to more than 1000% of its value only; another motion" in said
