"""`rigwatch study new` without logs asks for them at a terminal, and refuses without one."""

import argparse
import io
import os
import pty
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.commands.common import ask_for_logs
from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.steps import suggested
from rigwatch.workbench.study.study import open_study
from sim_plant.machines import MACHINES, log

COMMAND = (sys.executable, "-m", "rigwatch", "study", "new", "study")
END = b"\x04"
"""What ends the input, typed at a question that no answer is given for."""
LONGEST = 120.0
"""Time until a study is made on a busy machine [s]."""


def written(path: Path, header: str) -> None:
    rows = zip(*log(MACHINES["motor"], {}, 0.003, seed=1).values(), strict=True)
    lines = [header, *(",".join(f"{v:.9g}" for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


def answered(folder: Path, answers: Mapping[str, str]) -> str:
    """What the command says at a terminal where each of these questions is answered."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(COMMAND, cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    said, left = "", dict(answers)
    try:
        while text := _read(ours):
            said += text
            asked = said.rpartition("\n")[2]
            if asked.endswith(": "):
                question = next((each for each in left if asked.startswith(each)), None)
                os.write(ours, f"{left.pop(question)}\n".encode() if question else END)
        assert process.wait(LONGEST) == 0, said
    finally:
        process.kill()
        os.close(ours)
    return said


def _read(terminal: int) -> str:
    """What comes next; empty once the command has ended."""
    try:
        return os.read(terminal, 65536).decode()
    except OSError:
        return ""


def test_a_terminal_is_asked_for_what_the_headers_do_not_say(tmp_path: Path) -> None:
    written(tmp_path / "run.csv", "time_s,voltage_V,n")
    questions = {"logs of": "", "model": "motor", "column of voltage": "", "column of speed": "n"}
    said = answered(tmp_path, questions)
    assert "logs of the machine, separated by spaces [run.csv]: " in said
    assert "column of voltage, in V or COLUMN[UNIT] [voltage_V[V]]: " in said
    assert "--map 'speed=n[rad/s]'" in said
    study = open_study(tmp_path / "study")
    assert study.model.name == "motor"
    assert [span.session for span in study.file.train] == ["run.mcap"]


def test_without_a_terminal_it_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "new", str(tmp_path / "study")]) == 2
    assert "found neither --data nor --template" in capsys.readouterr().err
    assert not (tmp_path / "study").exists()


def test_only_what_a_header_tells_is_suggested() -> None:
    motor = shipped_models()["motor"]
    columns = ["t [ms]", "Motor voltage [V]", "Speed [rpm]"]
    both = {"voltage": "Motor voltage [V][V]", "speed": "Speed [rpm][rpm]"}
    assert suggested(columns, motor) == both
    assert suggested([*columns[:2], "Speed [ticks]"], motor) == {"voltage": both["voltage"]}


def test_a_quotation_that_is_not_closed_is_refused_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO("John's log.csv\n"))
    with pytest.raises(ModelError, match=r"John's log\.csv.*, expected names such as"):
        ask_for_logs(argparse.Namespace())
