"""Logs and options from which no honest study can be made: one plain line."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.physics.engine.equations.model import model_text
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.study.study import open_study
from sim_plant.machines import MACHINES, log
from tests.workbench.machine import studied
from tests.workbench.new_studies.test_kept_files import SERVO, TIME, UNITS

MOTOR = ["--model", "motor", "--set", "R=2.0", "--set", "K=0.06"]
Table = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def run() -> Table:
    return log(MACHINES["motor"], {}, 0.003, seed=1)


def written(path: Path, table: Table) -> Path:
    rows = (",".join(f"{v:.12g}" for v in row) for row in zip(*table.values(), strict=True))
    path.write_text("\n".join([",".join(table), *rows]) + "\n")
    return path


def new(folder: Path, *words: object) -> int:
    return main(["study", "new", str(folder / "study"), "--data", *map(str, words), *MOTOR])


def test_a_copy_of_a_log_does_not_decide_about_it(tmp_path, run, capsys):
    one, copy = (written(tmp_path / f"{name}.csv", run) for name in ("one", "copy"))
    assert new(tmp_path, one, copy) == 2
    assert "found the same samples in one.csv and copy.csv" in capsys.readouterr().err
    assert new(tmp_path, one, "--healthy", copy) == 2
    assert "found the same samples in one.csv and copy.csv" in capsys.readouterr().err
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize("healthy", [True, False])
def test_what_the_healthy_log_determines_is_told(
    tmp_path: Path, run: Table, capsys: pytest.CaptureFixture[str], *, healthy: bool
) -> None:
    model = tmp_path / "own.toml"
    text = model_text("motor").replace("[parameters.b]\n", "[parameters.b]\nkept = true\n")
    model.write_text(text)
    one, other = (log(MACHINES["motor"], {}, 0.003, seed) for seed in (1, 2))
    words = ["--data", str(written(tmp_path / "one.csv", one)), "--model", str(model)]
    words += ["--healthy", str(written(tmp_path / "may.csv", other))] if healthy else []
    assert main(["study", "new", str(tmp_path / "study"), *words, *MOTOR[2:]]) == 0
    told = "b: fitted to the healthy log alone"
    assert (told in capsys.readouterr().err) == healthy


def test_a_study_file_whose_held_out_recording_is_a_copy_is_told_so(tmp_path):
    table = {"goal": np.sin(TIME), "angle": np.sin(TIME - 0.5)}
    other = {name: 2 * values for name, values in table.items()}
    copied = prepare(studied(tmp_path / "a", SERVO, [table, other], [table], UNITS)).remarks
    apart = prepare(studied(tmp_path / "b", SERVO, [table], [other], UNITS)).remarks
    assert any("no evidence" in remark for remark in copied)
    assert not any("no evidence" in remark for remark in apart)


def test_a_study_file_whose_held_out_part_is_also_in_training_is_told_so(tmp_path, run):
    assert new(tmp_path, written(tmp_path / "run.csv", run)) == 0
    study = open_study(tmp_path / "study")
    assert not any("no evidence" in remark for remark in prepare(study).remarks)
    (train,), (held_out,) = study.file.train, study.file.held_out
    assert train.end == held_out.start
    text = study.text.replace(f"start = {held_out.start:.6g}", "start = 2.0")
    (tmp_path / "study" / "study.toml").write_text(text)
    told = [one for one in prepare(open_study(tmp_path / "study")).remarks if "no evidence" in one]
    (remark,) = told
    assert remark.startswith(f"held_out: run.mcap from 2 to {train.end:.4g} s is in training, too")


def test_a_folder_of_logs_is_not_a_log(tmp_path, capsys):
    assert new(tmp_path, tmp_path) == 2
    assert f"found a folder, expected a file such as {tmp_path}/*.csv" in capsys.readouterr().err


def test_a_log_of_one_row_is_refused(tmp_path, run, capsys):
    single = {name: values[:1] for name, values in run.items()}
    assert new(tmp_path, written(tmp_path / "one.csv", single)) == 2
    assert "found 1 samples in 0 s, expected at least two" in capsys.readouterr().err


def test_a_value_that_no_sensor_gives_is_an_invalid_sample(tmp_path, run):
    broken = run["speed_rad_s"].copy()
    broken[77] = 1e308
    assert new(tmp_path, written(tmp_path / "run.csv", run | {"speed_rad_s": broken})) == 0
    outputs = prepare(open_study(tmp_path / "study")).train.outputs[:, 0]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(outputs)), [77])


@pytest.mark.parametrize("option", ["nosuch=1", "run:nosuch=1"])
def test_a_value_of_an_unknown_parameter_is_refused_at_once(tmp_path, run, capsys, option):
    assert new(tmp_path, written(tmp_path / "run.csv", run), "--set", option) == 2
    assert "--set: found 'nosuch'" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["J=-2", "run:J=-2"])
def test_a_known_value_out_of_its_bounds_is_refused_at_once(tmp_path, run, capsys, option):
    assert new(tmp_path, written(tmp_path / "run.csv", run), "--set", option) == 2
    assert "--set: found J = -2, expected at least 1e-08 kg m^2" in capsys.readouterr().err
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize("option", ["J=nan", "run:J=nan", "J=inf"])
def test_a_known_value_that_is_no_number_is_refused(tmp_path, run, capsys, option):
    assert new(tmp_path, written(tmp_path / "run.csv", run), "--set", option) == 2
    value = option.rpartition("=")[2]
    assert f"--set: found J = {value}, expected a finite number" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["R=-2", "run:R=-2"])
def test_a_fixed_value_out_of_its_bounds_is_refused_at_once(tmp_path, run, capsys, option):
    data, study = written(tmp_path / "run.csv", run), tmp_path / "study"
    options = ["--model", "motor", "--set", "K=0.06", "--set", option]
    assert main(["study", "new", str(study), "--data", str(data), *options]) == 2
    assert "--set: found R = -2, expected at least 1e-06 ohm" in capsys.readouterr().err
    assert not study.exists()


def test_a_study_file_that_gives_a_fixed_value_out_of_its_bounds_is_refused(tmp_path, run, capsys):
    assert new(tmp_path, written(tmp_path / "run.csv", run)) == 0
    file = tmp_path / "study" / "study.toml"
    file.write_text(file.read_text().replace("R = 2.0", "R = -2.0"))
    assert main(["compare", str(tmp_path / "study")]) == 2
    told = capsys.readouterr().err
    assert f"{file}: start.R: found -2, expected at least 1e-06 ohm" in told


def test_a_time_under_another_name_is_asked_for_and_may_be_named_as_it_stands(
    tmp_path, run, capsys
):
    time, voltage, speed = run.values()
    columns = {"Zeit [s]": time, "pause [s]": 0 * time, "u [V]": voltage, "n [rad/s]": speed}
    path = written(tmp_path / "run.csv", columns)
    assert new(tmp_path, path) == 2
    said = capsys.readouterr().err
    assert "expected --time 'COLUMN[s]' or --rate HZ; its columns are Zeit [s], pause [s]" in said
    assert new(tmp_path, path, "--time", "Zeit [s]") == 0
    dt = prepare(open_study(tmp_path / "study")).train.dt
    assert dt == pytest.approx(time[1] - time[0], rel=1e-6)
