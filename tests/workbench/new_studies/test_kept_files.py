"""A new study changes no file that was there before, whether it can be made or not."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data.signals import prepare
from rigwatch.workbench.steps import from_logs
from rigwatch.workbench.steps.new_files import NewFiles
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import recorded

SERVO = """
name = "servo"
summary = "A first-order lag."
inputs.goal = { unit = "rad" }
states.x = { unit = "rad", derivative = "k*(goal - x)", measured = "angle" }
parameters.k = { value = 1.0, unit = "1/s", low = 0.0 }
outputs.angle = { unit = "rad", expression = "x" }
"""
TIME = np.arange(400) / 100
UNITS = {"goal": "rad", "angle": "rad"}


def session(path: Path, size: float = 1.0, angle: str = "angle") -> Path:
    path.parent.mkdir(exist_ok=True)
    table = {"goal": size * np.sin(TIME), angle: size * np.sin(TIME - 0.5)}
    recorded(path, table, UNITS | {angle: "rad"})
    return path


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "models" / "servo.toml"
    path.parent.mkdir()
    path.write_text(SERVO)
    return path


def new(folder: Path, log: Path, model: Path) -> int:
    return main(["study", "new", str(folder), "--data", str(log), "--model", str(model)])


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("angle", ["angle", "turn"], ids=["suits", "does not suit"])
def test_another_recording_of_the_same_name_is_neither_overwritten_nor_removed(
    tmp_path, model, capsys, angle
):
    own = session(tmp_path / "home" / "run.mcap", 2.0).parent
    other = session(tmp_path / "in" / "run.mcap", angle=angle)
    before = contents(own)
    assert new(own, other, model) == 2
    assert "run.mcap: the file exists already and is not overwritten" in capsys.readouterr().err
    assert contents(own) == before


def test_another_model_of_the_same_name_is_not_overwritten(tmp_path, model, capsys):
    own = tmp_path / "home"
    own.mkdir()
    (own / "servo.toml").write_text("# mine\n")
    assert new(own, session(tmp_path / "in" / "run.mcap"), model) == 2
    assert "servo.toml: the file exists already" in capsys.readouterr().err
    assert contents(own) == {"servo.toml": b"# mine\n"}


def test_a_recording_and_a_model_that_lie_in_the_folder_are_used_in_place(tmp_path, model):
    log = session(tmp_path / "home" / "run.mcap")
    own = log.parent / "servo.toml"
    own.write_text(SERVO)
    before = contents(log.parent)
    assert new(log.parent, log, own) == 0
    assert before.items() <= contents(log.parent).items()
    data = prepare(open_study(log.parent))
    np.testing.assert_allclose(data.train.inputs[:200, 0], np.sin(TIME)[:200], atol=1e-6)


def test_what_lies_in_the_folder_stays_if_the_study_cannot_be_made(tmp_path, model, capsys):
    log = session(tmp_path / "home" / "run.mcap", angle="turn")
    before = contents(log.parent)
    assert new(log.parent, log, model) == 2
    assert "found no channel 'angle'" in capsys.readouterr().err
    assert contents(log.parent) == before


def test_an_interruption_leaves_nothing_behind(tmp_path, model, monkeypatch):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(from_logs, "prepare", interrupted)
    assert new(tmp_path / "study", session(tmp_path / "in" / "run.mcap"), model) == 130
    assert not (tmp_path / "study").exists()


def test_the_ledger_of_an_earlier_study_is_not_continued(tmp_path, model, capsys):
    log = session(tmp_path / "in" / "run.mcap")
    assert new(tmp_path / "study", log, model) == 0
    (tmp_path / "study" / "study.toml").unlink()
    before = contents(tmp_path / "study")
    assert new(tmp_path / "study", log, model) == 2
    assert "ledger.jsonl: found the ledger of a study" in capsys.readouterr().err
    assert contents(tmp_path / "study") == before


def test_a_log_that_is_not_there_is_named(tmp_path, model, capsys):
    assert new(tmp_path / "study", tmp_path / "run.mcap", model) == 2
    assert "run.mcap: found no such file" in capsys.readouterr().err


def test_a_log_may_have_any_name(tmp_path, model):
    log = session(tmp_path / "logs" / 'run "ä" 1.mcap')
    assert new(tmp_path / "study", log, model) == 0
    assert {span.session for span in open_study(tmp_path / "study").file.train} == {log.name}


def test_two_that_make_one_study_at_once_do_not_remove_each_others_files(tmp_path):
    folder = tmp_path / "study"
    with NewFiles(folder) as first:
        first.to_write("run.mcap").write_text("of the first")
        refused = pytest.raises(ModelError, match="another process that makes a study there")
        with refused, NewFiles(folder) as second:
            second.to_write("other.mcap")
    assert (folder / "run.mcap").read_text() == "of the first"
    with pytest.raises(ModelError, match="exists already"), NewFiles(folder) as third:
        third.to_write("run.mcap")
    assert (folder / "run.mcap").read_text() == "of the first"
