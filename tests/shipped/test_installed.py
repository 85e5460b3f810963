"""The wheel in an environment of its own, as a newcomer has it: main jobs in an empty folder."""

import json
import math
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.shipped.test_wheel import LINE, STUDY, built

__all__ = ["built"]

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def command(built: Path) -> Path:
    """`rigwatch` as pip installs it, beside the packages that it depends on and no checkout."""
    home = built.parent / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home], check=True)
    inside = {"base": str(home), "platbase": str(home)}
    packages = Path(sysconfig.get_path("purelib", vars=inside))
    # An added folder is searched for packages, but its .pth files, as that of a checkout, are not
    # read.
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    python = home / "bin" / "python"
    words = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", str(built)]
    subprocess.run([python, *words], check=True)
    where = "import rigwatch; print(rigwatch.__file__)"
    said = subprocess.run([python, "-P", "-c", where], capture_output=True, text=True, check=True)
    assert said.stdout.startswith(str(home))
    return home / "bin" / "rigwatch"


Done = subprocess.CompletedProcess[str]


def run(command: Path, folder: Path, words: str, seconds: int = 120) -> Done:
    """What the installed command prints."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment["PATH"] = f"{command.parent}:{environment['PATH']}"
    done = subprocess.run(
        [command, *words.split()],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_the_demonstration_names_friction(command: Path, tmp_path: Path) -> None:
    said = run(command, tmp_path, "demo --headless", seconds=600).stderr
    assert "ALARM: dry friction" in said
    assert "none missing" in said


def test_a_log_is_imported_and_a_study_names_what_is_missing(command: Path, tmp_path: Path) -> None:
    speeds = [math.sin(0.06 * i + 0.002 * i * (i % 3)) for i in range(400)]
    rows = (f"{i / 100},{v},{3 * v + math.copysign(2, v)}" for i, v in enumerate(speeds))
    (tmp_path / "run.csv").write_text("t,v,f\n" + "\n".join(rows) + "\n")
    (tmp_path / "line.toml").write_text(LINE)
    (tmp_path / "own.toml").write_text(STUDY)
    run(command, tmp_path, "import run.csv run.mcap --time t[s] --map v=v[m/s] --map f=f[N]")
    run(command, tmp_path, "study new own --template own.toml")
    found = json.loads(run(command, tmp_path, "explain own --json").stdout)
    assert (found["verdict"], found["ranking"][0]["effect"]) == ("missing_effect", "coulomb")


def test_a_structure_is_identified(command: Path, tmp_path: Path) -> None:
    run(command, tmp_path, "structure simulate kabe_antenna antenna.csv")
    found = run(command, tmp_path, "structure identify kabe_antenna antenna.csv")
    assert "converged" in found.stdout
