"""The same study written in SI and in mm, bar and ms: one fit, one verdict, values as written."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages.message_types import Column, SampleBlock
from rigwatch.wire.session.writer import SessionWriter, run_info
from rigwatch.workbench.compare.compare import Comparison, compare
from rigwatch.workbench.data.signal_units import check_unit
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.report.text_report import comparison_lines
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.steps.ledger_replay import replay
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import Study, open_study
from tests.workbench.machine import studied

RATE = 200.0
SI = {
    "length": "m", "pressure": "Pa", "time": "s", "force": "N", "stiffness": "N/m",
    "k": 800.0, "k_high": 9000.0, "area": 2e-4, "area_unit": "m^2", "tau": 0.03, "tau_low": 0.001,
    "gap": 0.001, "gap_high": 0.01, "p0": 100000.0,
}  # fmt: skip
OTHER = SI | {
    "length": "mm", "pressure": "bar", "time": "ms", "force": "kN", "stiffness": "N/mm",
    "k": 0.8, "k_high": 9.0, "area": 2.0, "area_unit": "cm^2", "tau": 30.0, "tau_low": 1.0,
    "gap": 1.0, "gap_high": 10.0, "p0": 1.0,
}  # fmt: skip
MODEL = """
name = "cylinder"
summary = "A spring that follows late, and a piston."
inputs.position = {{ unit = "{length}" }}
inputs.pressure = {{ unit = "{pressure}" }}
outputs.force = {{ unit = "{force}", expression = "k*z + area*(pressure - p0) + load" }}
[states.z]
unit = "{length}"
derivative = "(position - z)/tau"
measured = "position"
[parameters.k]
value = {k}
unit = "{stiffness}"
low = 0.0
high = {k_high}
[parameters.area]
value = {area}
unit = "{area_unit}"
[parameters.tau]
value = {tau}
unit = "{time}"
low = {tau_low}
[parameters.p0]
value = {p0}
unit = "{pressure}"
fixed = true
[ports.load]
kind = "force"
unit = "{force}"
variables.x = {{ expression = "position", unit = "{length}" }}
"""
EFFECT = """
[effects.stop]
port = "force"
expression = "k*(max(x - gap, 0) - max(-x - gap, 0))"
physics = "Springs at both ends, behind a gap."
source = "this test"
parameters.k = {{ unit = "{stiffness}", value = 0.0, low = 0.0, role = "strength" }}
[effects.stop.parameters.gap]
unit = "{length}"
value = {gap}
low = 0.0
high = {gap_high}
tried = [{gap}]
"""
STUDY = """
model = "cylinder.toml"
horizon = 0.5
effect_files = ["stop.toml"]
start = {{ k = {k}, tau = {tau} }}
[[train]]
session = "a.mcap"
[[held_out]]
session = "b.mcap"
"""


def recorded(folder: Path, name: str, seed: int, units: tuple[str, str] = ("m", "Pa")) -> None:
    """A session of the plant: a stop of 4 N/mm behind 2 mm, which the model does not know."""
    chance = np.random.default_rng(seed)
    t = np.arange(2000) / RATE
    x = 3e-3 * np.sin(2 * np.pi * 0.9 * t + seed) + 1e-3 * np.sin(2 * np.pi * 2.3 * t)
    p = 3e5 + 1e5 * np.sin(2 * np.pi * 0.37 * t + 2 * seed)
    z = np.empty_like(x)
    z[0] = x[0]
    for i in range(1, len(x)):
        z[i] = z[i - 1] + (1 - np.exp(-1 / RATE / 0.04)) * (x[i - 1] - z[i - 1])
    stop = 4e3 * (np.maximum(x - 2e-3, 0) - np.maximum(-x - 2e-3, 0))
    force = 1000 * z + 1.8e-4 * (p - 1e5) + stop + 0.05 * chance.normal(size=len(t))
    per_unit = {"m": 1.0, "mm": 1e3, "Pa": 1.0, "bar": 1e-5, "s": 1.0}
    columns = [
        ("position", units[0], x * per_unit[units[0]]),
        ("pressure", units[1], p * per_unit[units[1]]),
        ("force", "N", force),
    ]
    write(folder / f"{name}.mcap", [Column(*c, np.zeros(len(t), np.uint8)) for c in columns])


def write(path: Path, columns: list[Column]) -> None:
    t_ns = np.round(np.arange(len(columns[0].values)) / RATE * 1e9).astype(np.int64)
    with SessionWriter(path, run_info("bench", RATE, t_ns=0), sync=False) as writer:
        writer.write(SampleBlock("rig", 1, 0, t_ns // 1000, t_ns, tuple(columns)))


def made(folder: Path, words: dict[str, Any], units: tuple[str, str] = ("m", "Pa")) -> Study:
    """A study whose files are written in these units."""
    folder.mkdir()
    recorded(folder, "a", 1, units)
    recorded(folder, "b", 2, units)
    for name, text in (("cylinder", MODEL), ("stop", EFFECT), ("template", STUDY)):
        (folder / f"{name}.toml").write_text(text.format(**words))
    return create(folder / "study", folder / "template.toml")


def numbers(found: Comparison) -> NDArray[np.float64]:
    return np.array([found.train_error, found.held_out_error, found.noise_floor])


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Study]:
    folder = tmp_path_factory.mktemp("units")
    return made(folder / "si", SI), made(folder / "other", OTHER)


@pytest.mark.nightly
def test_the_same_study_in_other_units_has_the_same_fit(pair: tuple[Study, Study]) -> None:
    si, other = map(compare, pair)
    assert numbers(other) == pytest.approx(numbers(si), rel=1e-9)
    for name, size, unit in [("k", 1e-3, "N/mm"), ("area", 1e4, "cm^2"), ("tau", 1e3, "ms")]:
        one, shown = si.parameters[name], other.parameters[name]
        assert shown.unit == unit
        assert shown.value == pytest.approx(one.value * size, rel=1e-9)
        assert shown.interval == pytest.approx(np.multiply(one.interval, size), rel=1e-6)
    lines = comparison_lines(other)
    assert next(line for line in lines if line.startswith("  tau ")).endswith(" ms")
    assert other.unit == "N"
    told = next(line for line in lines if line.startswith("  force ")).split()
    assert told[1:3] == ["kN", f"{other.train_error / 1e3:.4g}"]


def test_what_a_parameter_on_a_bound_means_is_said(pair: tuple[Study, Study]) -> None:
    found = compare(pair[0])
    assert found.convergence is not None
    ended = replace(found.convergence, at_bound=("k",))
    lines = comparison_lines(replace(found, convergence=ended))
    place = lines.index("  on a bound: k")
    assert "ask for the bound's value or one beyond it" in lines[place + 1]
    assert not any("beyond it" in line for line in comparison_lines(found))


def test_the_same_study_in_other_units_has_the_same_verdict(pair: tuple[Study, Study]) -> None:
    si, other = map(explain, pair)
    assert si.verdict == other.verdict
    assert [row.effect for row in si.ranking] == [row.effect for row in other.ranking]
    assert [r.p_value for r in other.ranking] == pytest.approx([r.p_value for r in si.ranking])
    one, shown = (found.ranking[0] for found in (si, other))
    assert one.effect == shown.effect == "stop"
    assert shown.parameters["gap"].unit == "mm"
    errors = (other.comparison.held_out_error, shown.held_out_error)
    assert "from {:.3g} to {:.3g} kN".format(*(error / 1e3 for error in errors)) in other.text
    assert shown.parameters["gap"].value == pytest.approx(2.0, rel=0.1)
    assert one.parameters["gap"].value == pytest.approx(0.002, rel=0.1)


def test_what_is_added_stands_in_the_file_as_it_is_written(pair: tuple[Study, Study]) -> None:
    found = [add(study, "stop", "load") for study in pair]
    assert [change.step for change in found] == ["add", "add"]
    assert numbers(found[1].after) == pytest.approx(numbers(found[0].after), rel=1e-6)
    shown = found[1].after.parameters["load_stop_gap"]
    assert (shown.value, shown.unit) == (pytest.approx(2.0, rel=0.05), "mm")
    again = [open_study(study.folder) for study in pair]
    written = (pair[1].folder / "study.toml").read_text().partition("gap = ")[2]
    assert float(written.split()[0]) == pytest.approx(2.0, rel=0.05)
    si, other = (study.file.effects[0].parameters for study in again)
    assert other == pytest.approx(si, rel=1e-6)
    assert numbers(compare(again[1])) == pytest.approx(numbers(compare(again[0])), rel=1e-6)
    assert all(check.same for study in again for check in replay(study))


def test_a_channel_recorded_in_other_units_is_converted(
    pair: tuple[Study, Study], tmp_path: Path
) -> None:
    given = made(tmp_path / "raw", SI, ("mm", "bar"))
    bare = [replace(study, file=pair[0].with_effects([]).file) for study in (pair[0], given)]
    si, raw = map(compare, bare)
    assert numbers(raw) == pytest.approx(numbers(si), rel=1e-6)


def test_a_channel_that_measures_something_else_is_refused(tmp_path: Path) -> None:
    study = made(tmp_path / "raw", SI, ("s", "Pa"))
    with pytest.raises(ModelError, match=r"position: found channel 'position' in \[s\], expected"):
        compare(study)


def test_turns_and_angles_are_not_taken_for_each_other() -> None:
    from rigwatch.physics.engine.equations.model import Input

    check_unit("rpm", Input(unit="rad/s"), "channel 'n'", "motor: n")
    check_unit("Hz", Input(unit="1/s"), "channel 'n'", "motor: n")
    with pytest.raises(ModelError, match=r"found channel 'n' in \[rpm\]"):
        check_unit("rpm", Input(unit="Hz"), "channel 'n'", "motor: n")
    with pytest.raises(ModelError, match="g is the gram, write g0"):
        check_unit("g", Input(unit="m/s^2"), "channel 'a'", "tower: a")
    with pytest.raises(ModelError, match="unknown unit 'volts'"):
        check_unit("volts", Input(unit="V"), "channel 'u'", "tower: u")


COOLING = """
name = "cup"
summary = "A cup that cools; its temperature is read in degrees Celsius."
inputs.q = { unit = "K/s" }
states.a = { unit = "degC", derivative = "q - g*a + load", measured = "a" }
parameters.g = { value = 0.3, unit = "1/s" }
outputs.a = { unit = "degC", expression = "a" }
[ports.load]
kind = "force"
unit = "K/s"
variables.x = { expression = "a", unit = "degC" }
[ports.a_sensor]
kind = "sensor"
signal = "a"
"""


def test_the_offset_of_a_sensor_in_degrees_celsius_is_a_difference(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    table = {"q": generator.normal(size=600), "a": 20 + generator.normal(size=600)}
    study = studied(tmp_path, COOLING, [table], [table], {"q": "K/s", "a": "degC"})
    own = study.effect_at("offset", "a_sensor").parameters["u0"]
    assert (own.neutral, own.value, own.unit, own.shown or own.unit) == (0.0, 0.0, "K", "K")
