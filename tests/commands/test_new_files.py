"""A file that a command writes stands under its name when it is complete, or not at all."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import SessionError
from rigwatch.wire.host import replace_file
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session import SessionWriter, run_info
from tests.recorder.full_disk import largest_file
from tests.waiting import eventually

STRUCTURE = "configs/structures/kabe_antenna.toml"
SCENARIO = "configs/scenarios/experiment_1.toml"


@pytest.fixture
def session(tmp_path: Path) -> Path:
    return written(tmp_path / "run.mcap", 4000)


def written(path: Path, count: int) -> Path:
    with SessionWriter(path, run_info("bench1", 256.0, t_ns=1), sync=False) as writer:
        for at in range(0, count, 4000):
            index = np.arange(at, at + 4000)
            values = np.random.default_rng(at).normal(size=4000)
            column = Column("position", "m", values, np.zeros(4000, np.uint8))
            writer.write(SampleBlock("rig", 7, at, index * 3906, index * 3_906_250, (column,)))
    return path


def began(path: Path) -> list[Path]:
    """What lies beside a file under a name that begins with its own."""
    return sorted(other for other in path.parent.iterdir() if other.name.startswith(path.name))


@pytest.mark.parametrize(
    "command",
    [
        "export RUN OUT.csv",
        "export RUN OUT.parquet",
        "export RUN OUT.mat",
        "trim RUN OUT.mcap --start 1",
        "recover RUN OUT.mcap",
        f"plant --session OUT.mcap {SCENARIO} --seconds 2",
        "model new OUT.toml",
    ],
)
def test_full_disk_leaves_nothing(
    tmp_path: Path, session: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    words = words_of(command, session, tmp_path)
    target = next(Path(word) for word in words if Path(word).name.startswith("out"))
    assert main(words) == 0  # compiles what it needs, which goes into files too
    target.unlink()
    with largest_file(90):
        assert main(words) == 2
    told = capsys.readouterr().err
    assert f"{target}: cannot be written: " in told
    assert "ile too large" in told
    assert not began(target)
    assert main(words) == 0
    assert began(target) == [target]
    before = target.read_bytes()
    assert main(words) == 2
    assert f"{target}: the file exists already" in capsys.readouterr().err
    assert target.read_bytes() == before


def words_of(command: str, session: Path, folder: Path) -> list[str]:
    named = {"RUN": str(session), "STRUCTURE": STRUCTURE}
    words = [named.get(word, word) for word in command.split()]
    return [str(folder / word.lower()) if word.startswith("OUT") else word for word in words]


@pytest.mark.parametrize(
    "command",
    [
        "effects dahl --save OUT.svg",
        "model check heated-block --input ambient=293 --save OUT.svg",
        "structure modes STRUCTURE --svg OUT.svg",
        "structure modes STRUCTURE --report OUT.html",
    ],
)
def test_full_disk_keeps_the_file_before(
    tmp_path: Path, session: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    words = words_of(command, session, tmp_path)
    target = Path(words[-1])
    assert main(words) == 0
    target.write_text("before")
    with largest_file(90):
        assert main(words) == 2
    assert f"{target}: cannot be written: file too large" in capsys.readouterr().err
    assert target.read_text() == "before"
    assert began(target) == [target]
    assert main(words) == 0
    assert len(target.read_bytes()) > 90


@pytest.fixture(scope="module")
def long_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session whose export takes seconds."""
    return written(tmp_path_factory.mktemp("long") / "long.mcap", 2_000_000)


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        signal.SIGINT,
        pytest.param(signal.SIGHUP, marks=pytest.mark.nightly),
        signal.SIGKILL,
    ],
)
def test_interrupted_export_leaves_nothing(
    tmp_path: Path, session: Path, long_session: Path, number: signal.Signals
) -> None:
    target = tmp_path / "long.csv"
    as_usual = ["env", "--default-signal=HUP"]  # whatever has started the tests may ignore it
    words = [sys.executable, "-m", "rigwatch", "export", str(long_session), str(target)]
    with subprocess.Popen([*as_usual, *words], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        eventually(lambda: any(part.stat().st_size for part in began(target)), "rows are written")
        process.send_signal(number)
        code, told = process.wait(), process.stderr.read()
    assert code == (130 if number == signal.SIGINT else -number)
    assert told == ""
    assert not target.exists()
    assert len(began(target)) == (number == signal.SIGKILL)
    assert main(["export", str(session), str(target)]) == 0
    assert began(target) == [target]


def test_a_file_that_came_in_the_meantime_is_kept(tmp_path: Path) -> None:
    target = tmp_path / "run.csv"

    def late() -> None:
        with new_file(target) as part:
            part.write_text("late")
            target.write_text("early")

    with pytest.raises(SessionError, match="exists already"):
        late()
    assert target.read_text() == "early"
    assert began(target) == [target]


def test_a_link_stays_a_link_and_a_file_keeps_its_mode(tmp_path: Path) -> None:
    file, link = tmp_path / "report.html", tmp_path / "latest.html"
    file.write_text("old")
    file.chmod(0o600)
    link.symlink_to(file)
    with new_file(link, replace=True) as part:
        part.write_text("new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    assert file.stat().st_mode & 0o777 == 0o600


def test_a_report_may_go_to_a_device() -> None:
    with new_file(Path("/dev/null"), replace=True) as part:
        part.write_text("nothing")
    assert Path("/dev/null").is_char_device()


def test_a_file_that_cannot_be_replaced_stays_and_nothing_is_beside_it(tmp_path: Path) -> None:
    target, left = tmp_path / "model.toml", tmp_path / f"model.toml.{2**22 + 1}.part"
    replace_file(target, "before")
    left.write_text("of a killed process")
    with largest_file(90), pytest.raises(OSError, match="File too large"):
        replace_file(target, "x" * 200)
    assert target.read_text() == "before"
    assert began(target) == [target]
