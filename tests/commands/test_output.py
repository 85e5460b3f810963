"""Commands write to closed pipes, full disks and terminals of any encoding without a traceback."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rigwatch.archive import Store, index
from rigwatch.commands import main
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.session import SessionWriter, run_info

NAME = "Δp → 🙂"
COMMANDS = ["info RUN", "info RUN --json", "effects --json", "archive query ROOT rigs"]
HELP = ["--help", "--version", "study --help", "import --help"]


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An archive with one recording of a channel whose name few encodings have."""
    made = tmp_path_factory.mktemp("archive")
    index_ = np.arange(100)
    column = Column(NAME, "m", np.ones(100), np.zeros(100, np.uint8))
    with SessionWriter(made / "run.mcap", run_info(NAME, 256.0, t_ns=1)) as writer:
        writer.write(SampleBlock("rig", 7, 0, index_ * 3906, index_ * 3_906_250, (column,)))
    index(Store(str(made)))
    return made


def typed(command: str, root: Path) -> list[str]:
    places = {"RUN": str(root / "run.mcap"), "ROOT": str(root)}
    return [places.get(word, word) for word in command.split()]


def words(command: str, root: Path) -> list[str]:
    return [sys.executable, "-m", "rigwatch", *typed(command, root)]


@pytest.mark.parametrize("command", COMMANDS)
def test_an_encoding_that_lacks_characters_gets_escapes(
    root: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "latin-1"}
    done = subprocess.run(words(command, root), capture_output=True, env=environment, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    if "--json" in command:
        assert main(typed(command, root)) == 0
        assert json.loads(done.stdout.decode("latin-1")) == json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("command", [*COMMANDS, *HELP])
def test_a_full_disk_and_a_closed_pipe_are_told_by_the_exit_code(root: Path, command: str) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            words(command, root), stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    said = "rigwatch: the output cannot be written: no space left on the disk\n"
    assert (done.returncode, done.stderr) == (2, said)
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as closed:
        done = subprocess.run(
            words(command, root), stdout=closed, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (2, "")
