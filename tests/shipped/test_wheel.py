"""The wheel: every module and data file, and the example configurations that the demo needs."""

import json
import math
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hatchling.build import build_wheel

ROOT = Path(__file__).parents[2]
PACKAGES = ("daq", "monitor", "rigwatch", "sim_plant")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return folder / build_wheel(str(folder))


@pytest.fixture(scope="module")
def contents(built: Path) -> set[str]:
    with zipfile.ZipFile(built) as wheel:
        return set(wheel.namelist())


def test_it_holds_every_module_and_data_file(contents: set[str]) -> None:
    files = [path for top in PACKAGES for path in (ROOT / top).rglob("*") if path.is_file()]
    kept = {str(path.relative_to(ROOT)) for path in files if "__pycache__" not in path.parts}
    assert kept <= contents


def test_it_holds_the_example_configurations(contents: set[str]) -> None:
    files = (ROOT / "configs").rglob("*.toml")
    assert {f"rigwatch/{path.relative_to(ROOT)}" for path in files} <= contents


LINE = """
name = "damper"
summary = "A force that grows with speed."
inputs.v = { unit = "m/s" }
parameters.c = { unit = "N*s/m" }
outputs.f = { unit = "N", expression = "c*v - load" }
ports.load = { kind = "force", unit = "N", variables.v = { expression = "v", unit = "m/s" } }
"""
STUDY = """
model = "line.toml"
train = [{ session = "run.mcap", end = 2.0 }]
held_out = [{ session = "run.mcap", start = 2.0 }]
"""
DO = """
import contextlib, io, json, sys
site, commands = sys.argv[1], json.loads(sys.argv[2])
sys.path.insert(0, site)
import rigwatch
assert rigwatch.__file__.startswith(site), rigwatch.__file__
from rigwatch.commands import main
told = []
for command in commands:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        code = main(command)
    assert code == 0, (command, code)
    told.append(out.getvalue())
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def installed(built: Path) -> Path:
    """The wheel alone, unpacked as an installer does; no checkout is on the path."""
    site = built.parent / "site"
    with zipfile.ZipFile(built) as wheel:
        wheel.extractall(site)
    return site


def run(site: Path, folder: Path, *commands: str) -> list[str]:
    """What commands of the installed wheel print in a folder; Python looks nowhere near."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    words = json.dumps([command.split() for command in commands])
    arguments = [sys.executable, "-P", "-c", DO, str(site), words]
    done = subprocess.run(
        arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return list(json.loads(done.stdout))


def test_installed_alone_it_finds_what_its_commands_need(installed: Path, tmp_path: Path) -> None:
    speeds = [math.sin(0.06 * i + 0.002 * i * (i % 3)) for i in range(400)]
    rows = (f"{i / 100},{v},{3 * v + math.copysign(2, v)}" for i, v in enumerate(speeds))
    (tmp_path / "run.csv").write_text("t,v,f\n" + "\n".join(rows) + "\n")
    (tmp_path / "line.toml").write_text(LINE)
    (tmp_path / "own.toml").write_text(STUDY)

    _, modes, _, _, compared, explained, copied = run(
        installed,
        tmp_path,
        "plant healthy_sine_8hz_1v5 --session a.mcap --seconds 4",
        "structure modes shear_frame",
        "import run.csv run.mcap --time t[s] --map v=v[m/s] --map f=f[N]",
        "study new own --template own.toml",
        "compare own",
        "explain own --json",
        "init mine",
    )

    assert "most to suspect" in modes
    assert "held out" in compared
    assert "coulomb" in explained
    assert "files copied" in copied
    assert (tmp_path / "mine" / "configs" / "demo.toml").is_file()
