"""Parameters that are known of each recording: a load that was changed between two runs."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import ConfigError
from rigwatch.workbench.compare import compare, open_bench
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.report import comparison_lines
from rigwatch.workbench.study import open_study
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


@pytest.mark.nightly
def test_what_is_known_of_a_recording_counts_in_it_alone(tmp_path: Path) -> None:
    found = explain(create(tmp_path / "study", template(tmp_path)))
    assert (found.verdict, found.ranking[0].effect) == ("missing_effect", "coulomb")
    assert found.ranking[0].held_out_error < 0.01
    assert "m" not in found.comparison.parameters


def test_a_parameter_that_the_model_does_not_have_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'mass'.*parameters of the model: m0, m, c"):
        create(tmp_path / "study", template(tmp_path, "mass"))


def test_without_what_is_known_of_each_recording_the_fit_is_bad(tmp_path: Path) -> None:
    path = template(tmp_path)
    path.write_text("\n".join(x for x in path.read_text().splitlines() if "parameters" not in x))
    bench = open_bench(create(tmp_path / "study", path))
    assert bench.base.held_out_error > 0.05


def test_what_is_known_is_shown_in_its_unit(tmp_path: Path, capsys) -> None:
    study = create(tmp_path / "study", template(tmp_path))
    assert main(["study", "show", str(study.folder)]) == 0
    shown = capsys.readouterr().out
    assert "full.mcap (train): m = 1500 g" in shown
    assert [str(one).removeprefix("../") for one in study.known] == [
        "empty.mcap (train): m = 0 g",
        "full.mcap (train): m = 1500 g",
        "half.mcap (held out): m = 500 g",
    ]
    lines = "\n".join(comparison_lines(compare(study)))
    assert "input push" in lines
    assert "input m" not in lines


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("inf", r"held_out\[0\].parameters.m: found inf, expected a finite number"),
        ("'heavy'", r"parameters.m: found 'heavy', expected a number"),
    ],
)
def test_a_value_that_is_no_number_is_refused(tmp_path: Path, given: str, said: str) -> None:
    path = template(tmp_path)
    path.write_text(path.read_text().replace("m = 500.0", f"m = {given}"))
    with pytest.raises(ConfigError, match=said):
        create(tmp_path / "study", path)


def test_logs_with_known_loads_become_a_study(tmp_path: Path, capsys) -> None:
    template(tmp_path)
    logs = [str(tmp_path / f"{name}.csv") for name in LOADS]
    known = [f"--set={name}:m={1e3 * load}" for name, load in LOADS.items()]
    for log in logs:
        path = Path(log)
        _, *rest = path.read_text().splitlines()
        rows = [f"{0.01 * i:.2f},{row}" for i, row in enumerate(rest)]
        path.write_text("\n".join(["time[s],push[N],v[m/s]", *rows]) + "\n")
    folder = tmp_path / "study"
    begin = ["study", "new", str(folder), "--data", *logs, "--model", str(tmp_path / "model.toml")]
    assert main([*begin, *known]) == 0
    file = open_study(folder).file
    given = {span.session: span.parameters["m"] for span in (*file.train, *file.held_out)}
    assert given == {f"{name}.mcap": load for name, load in LOADS.items()}
    shutil.rmtree(folder)
    assert main([*begin, "--set", "ful:m=1"]) == 2
    assert "--set: found log 'ful'; did you mean 'full'?" in capsys.readouterr().err
    assert main([*begin, "--set", "m=load"]) == 2
    said = r"found no number 'load' beside its columns; give it with --set \w+:m=VALUE"
    assert re.search(said, capsys.readouterr().err)


def stating(folder: Path, factor: float = 1.0, number: str = "load") -> list[str]:
    """The logs of the loads as JSON with a header that states each load."""
    template(folder)
    paths = []
    for name, load in LOADS.items():
        _, *rest = (folder / f"{name}.csv").read_text().splitlines()
        rows = [[0.01 * i, *map(float, row.split(","))] for i, row in enumerate(rest)]
        entries = [dict(zip(("time", "push", "v"), row, strict=True)) for row in rows]
        header = {"rig": {number: load * factor}, "driver": "x"}
        path = folder / f"{name}.json"
        path.write_text(json.dumps({**header, "entries": entries}))
        paths.append(str(path))
    return paths


@pytest.mark.parametrize("name", ["m", "full:m"])
def test_a_known_value_may_have_a_unit_of_its_own(tmp_path: Path, capsys, name: str) -> None:
    begin = ["study", "new", str(tmp_path / "study"), "--data", *stating(tmp_path)]
    begin += ["--model", str(tmp_path / "model.toml")]
    assert main([*begin, "--set", f"{name}=0.141[kg]"]) == 0
    file = open_study(tmp_path / "study").file
    known = {span.session: span.parameters for span in (*file.train, *file.held_out)}
    # In the study's file in the model's unit, g; what is read from it is in SI.
    found = file.start["m"] if name == "m" else known["full.mcap"]["m"]
    assert found == pytest.approx(0.141)
    shutil.rmtree(tmp_path / "study")
    assert main([*begin, "--set", f"{name}=0.141[s]"]) == 2
    told = f"--set {name}=0.141[s]: found s, expected a unit like g"
    assert told in capsys.readouterr().err
    assert main([*begin, "--set", f"{name}=0.141[kilo]"]) == 2
    assert "the unknown unit 'kilo'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "factor", "number", "told"),
    [
        ("m=rig.load[kg]", 1.0, "load", ""),
        ("m=rig.load", 1e3, "load", "rig.load: no unit in its name, assumed g"),
        ("m=rig.load_kg", 1.0, "load_kg", "rig.load_kg: read in kg, as its name says"),
        ("m=rig.load_s", 1e3, "load_s", "rig.load_s: no unit in its name, assumed g"),
    ],
)
def test_a_parameter_is_a_number_that_each_log_states(  # noqa: PLR0917 -- one case
    tmp_path: Path, capsys, text: str, factor: float, number: str, told: str
) -> None:
    logs = stating(tmp_path, factor, number)
    begin = ["study", "new", str(tmp_path / "study"), "--data", *logs]
    assert main([*begin, "--model", str(tmp_path / "model.toml"), "--set", text]) == 0
    shown = capsys.readouterr()
    assert told in shown.out + shown.err
    file = open_study(tmp_path / "study").file
    given = {span.session: span.parameters["m"] for span in (*file.train, *file.held_out)}
    assert given == {f"{name}.mcap": pytest.approx(load) for name, load in LOADS.items()}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("m=rig.lod", "--set m=rig.lod: .*: found no number 'rig.lod'; did you mean 'rig.load'?"),
        ("q=rig.load", "--set q=rig.load: found 'q', expected one of"),
        ("m=rig.load[s]", r"--set m=rig.load\[s\]: found s, expected a unit like g"),
        ("full:m=rig.load", "--set: found 'full:m=rig.load', expected NAME=VALUE"),
    ],
)
def test_a_number_that_a_log_does_not_state_is_reported(
    tmp_path: Path, capsys, text: str, said: str
) -> None:
    begin = ["study", "new", str(tmp_path / "study"), "--data", *stating(tmp_path)]
    assert main([*begin, "--model", str(tmp_path / "model.toml"), "--set", text]) == 2
    assert re.search(said, capsys.readouterr().err)
    assert not (tmp_path / "study").exists()
