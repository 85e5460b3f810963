"""From logs of a machine to a study, by the command that a newcomer types."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from msgspec import json

from rigwatch.commands import main
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.study.study import open_study
from sim_plant.machines import MACHINES, log

MOTOR = ["--model", "motor", "--set", "R=2.0", "--set", "K=0.06"]


def written(path: Path, table: Mapping[str, np.ndarray], separator=",", point=".") -> Path:
    rows = [separator.join(table)]
    rows += [
        separator.join(f"{value:.9g}".replace(".", point) for value in row)
        for row in zip(*table.values(), strict=True)
    ]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def run() -> dict[str, np.ndarray]:
    return log(MACHINES["motor"], {"coulomb": 0.02}, 0.003, seed=1)


def made(folder: Path, *logs: Path, more: list[str] = MOTOR) -> int:
    return main(["study", "new", str(folder / "study"), "--data", *map(str, logs), *more])


def test_headers_tell_channels_and_units_and_the_study_can_be_fitted(tmp_path, run, capsys):
    other = log(MACHINES["motor"], {"coulomb": 0.02}, 0.003, seed=2)
    paths = [written(tmp_path / f"run{i}.csv", t) for i, t in enumerate((run, other), 1)]
    assert made(tmp_path, *paths) == 0
    said = capsys.readouterr()
    assert f"next: rigwatch explain {tmp_path / 'study'}" in said.out
    assert "speed from 'speed_rad_s' in rad/s" in said.err
    study = open_study(tmp_path / "study")
    assert {span.session for span in (*study.file.train, *study.file.held_out)} == {
        "run1.mcap", "run2.mcap",
    }  # fmt: skip
    data = prepare(study)
    spans = (*study.file.train, *study.file.held_out)
    read = {"run1.mcap": run, "run2.mcap": other}
    for span, recording in zip(spans, (data.train, data.held_out), strict=True):
        told = read[span.session]["speed_rad_s"][:500]
        np.testing.assert_allclose(recording.outputs[:500, 0], told, rtol=1e-8)


def test_one_log_is_cut_in_two_where_it_moves(tmp_path, run):
    rest = 3000
    still = {name: np.concatenate([values, np.zeros(rest)]) for name, values in run.items()}
    still["time_s"] = np.arange(len(still["time_s"])) / 200.0
    assert made(tmp_path, written(tmp_path / "run.csv", still)) == 0
    file = open_study(tmp_path / "study").file
    (told,), (decides,) = file.train, file.held_out
    moves = len(run["time_s"]) / 200.0
    assert told.end == decides.start
    assert told.end < moves
    assert decides.end < moves + 0.5


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_decimal_comma_gives_the_same_study(tmp_path, run, separator):
    assert made(tmp_path, written(tmp_path / "run.csv", run, separator, ",")) == 0
    data = prepare(open_study(tmp_path / "study"))
    np.testing.assert_allclose(data.train.outputs[:100, 0], run["speed_rad_s"][:100], atol=1e-6)


def test_loggers_of_slightly_different_rates_and_jitter_are_combined(tmp_path, run):
    random = np.random.default_rng(0)
    paths = []
    for name, rate in (("slow", 188.1), ("fast", 188.8)):
        times = np.arange(len(run["time_s"])) / rate
        times += random.uniform(-0.2, 0.2, len(times)) / rate
        paths.append(written(tmp_path / f"{name}.csv", {**run, "time_s": times}))
    assert made(tmp_path, *paths) == 0
    data = prepare(open_study(tmp_path / "study"))
    assert 1 / data.train.dt == pytest.approx(188.1, rel=2e-3)
    json.encode(data.train.dt)  # the lateness of a held input, in seconds, is told as JSON


def test_a_speed_that_no_column_shows_is_made_from_the_displacement(tmp_path):
    table = log(MACHINES["damper"], {}, 0.002, seed=1)
    path = written(tmp_path / "run.csv", table)
    assert made(tmp_path, path, more=["--model", "damper"]) == 0
    study = open_study(tmp_path / "study")
    data = prepare(study)
    place = list(study.model.inputs).index("velocity")
    expected = np.gradient(table["displacement_m"], 1 / 200.0)[: len(data.train)]
    assert np.corrcoef(data.train.inputs[:, place], expected)[0, 1] > 0.99


def test_speed_and_acceleration_are_both_made_from_the_position_and_the_residual_is_thinned_alike(
    tmp_path,
):
    time = np.arange(8000) / 500.0
    position = 0.1 * np.sin(2.0 * time) + 0.02 * np.sin(5.0 * time)
    table = {"time_s": time, "position_m": position, "force_N": 20 * np.cos(2.0 * time)}
    assert made(tmp_path, written(tmp_path / "run.csv", table), more=["--model", "emps-force"]) == 0
    file = open_study(tmp_path / "study").file
    derived = {name: (s.channel, s.order) for name, s in file.derive.signals.items()}
    assert derived == {"velocity": ("position", 1), "acceleration": ("position", 2)}
    assert file.thin.factor * file.derive.low_pass == pytest.approx(500 / 2.5, rel=0.1)


def test_columns_without_names_are_named_by_an_option(tmp_path, run):
    path = written(tmp_path / "run.csv", run)
    path.write_text(path.read_text().partition("\n")[2])
    columns = ["--columns", "time_s,voltage_V,speed_rad_s"]
    assert made(tmp_path, path, more=[*MOTOR, *columns]) == 0


@pytest.mark.parametrize(
    ("columns", "more", "said"),
    [
        pytest.param(("time_s", "a", "b"), MOTOR, "--map 'voltage=COLUMN[V]'", id="no such column"),
        pytest.param((), ["--model", "moter"], "did you mean 'motor'", id="no such model"),
        pytest.param((), [], "--model", id="no model"),
        pytest.param((), [*MOTOR, "--set", "R"], "expected NAME=VALUE", id="no value"),
    ],
)
def test_what_is_missing_is_reported_and_nothing_is_left_behind(
    tmp_path, capsys, columns, more, said
):
    run = log(MACHINES["motor"], {}, 0.003, seed=1)
    table = dict(zip(columns or run, run.values(), strict=True))
    assert made(tmp_path, written(tmp_path / "run.csv", table), more=more) != 0
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert not (tmp_path / "study").exists()


SERVO = """
name = "servo"
summary = "An angle called position."
inputs.goal = { unit = "rad" }
states.x = { unit = "rad", derivative = "k*(goal - x)", measured = "position" }
parameters.k = { value = 1.0, unit = "1/s", low = 0.0 }
outputs.position = { unit = "rad", expression = "x" }
"""


@pytest.mark.parametrize(("header", "factor"), [("position", 1.0), ("position_deg", np.pi / 180)])
def test_the_model_states_what_a_position_is_measured_in(tmp_path, header, factor):
    (tmp_path / "servo.toml").write_text(SERVO)
    time = np.arange(400) / 100
    table = {"time_s": time, "goal_rad": np.sin(time), header: np.sin(time - 0.5) / factor}
    longer = {name: np.append(values, values[-1] + 0.01) for name, values in table.items()}
    paths = [written(tmp_path / f"{n}.csv", t) for n, t in (("one", table), ("two", longer))]
    assert made(tmp_path, *paths, more=["--model", str(tmp_path / "servo.toml")]) == 0
    data = prepare(open_study(tmp_path / "study"))
    np.testing.assert_allclose(data.train.outputs[:300, 0], np.sin(time - 0.5)[:300], atol=1e-6)


def test_of_many_logs_a_quarter_is_held_out_spread_over_them_and_remarks_come_once(
    tmp_path, capsys
):
    (tmp_path / "servo.toml").write_text(SERVO)
    paths = []
    for number in range(16):
        time = np.arange(400) / (100 + 0.1 * number)
        size = 1.0 + (number == 5)
        table = {"time": time, "goal": size * np.sin(time), "position": np.sin(time - 0.5)}
        paths.append(written(tmp_path / f"log{number:02d}.csv", table))
    assert made(tmp_path, *paths, more=["--model", str(tmp_path / "servo.toml")]) == 0
    file = open_study(tmp_path / "study").file
    held_out = [int(span.session[3:5]) for span in file.held_out]
    assert len(held_out) == 4
    assert len(file.train) == 12
    # Logs of a series of settings stand in order; the one that goes furthest is for training.
    assert max(np.diff([-1, *held_out, 16])) <= 8
    assert 5 not in held_out
    said = capsys.readouterr().err.splitlines()
    assert said.count("log00.csv and 15 more: goal: no unit in its header, assumed rad") == 1
    assert sum("Hz, each at its own rate" in line for line in said) == 1
    assert sum("are not counted" in line for line in said) <= 2


def test_a_model_of_ones_own_with_wrong_units_says_so_and_leaves_no_folder(tmp_path, run, capsys):
    own = (
        'name = "mine"\nsummary = "A spring."\ninputs.voltage = { unit = "V" }\n'
        'states.x = { unit = "m", derivative = "k*voltage + x" }\n'
        'parameters.k = { value = 1.0, unit = "m" }\n'
        'outputs.speed = { unit = "rad/s", expression = "x" }\n'
    )
    (tmp_path / "mine.toml").write_text(own)
    log_file = written(tmp_path / "run.csv", run)
    assert made(tmp_path, log_file, more=["--model", str(tmp_path / "mine.toml")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"rigwatch: {tmp_path / 'mine.toml'}: ")  # the file to be changed
    assert "expected one unit" in said
    assert "directory not empty" not in said
    assert not (tmp_path / "study").exists()
