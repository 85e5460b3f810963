"""The workbench from Python: what the commands do, with arrays and data frames in and out."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import rigwatch
from rigwatch.wire.errors import ImportDataError, ModelError
from tests.workbench.conftest import CONFIGS

# Packages that take long to load are imported where they are used: every worker reads this file.
NOTEBOOKS = Path(__file__).parents[3] / "docs" / "notebooks"
RATE = 100.0
MODEL = """
name = "slide"
summary = "A mass on guides, pushed."
inputs.force = { unit = "N" }
parameters.m = { value = 1.0, unit = "kg" }
states.v = { unit = "m/s", derivative = "(force + load)/m" }
outputs.speed = { unit = "m/s", expression = "v" }
[ports.load]
kind = "force"
unit = "N"
variables.v = { expression = "v", unit = "m/s" }
"""


@cache
def run(seed: int) -> dict[str, np.ndarray]:
    """A mass with drag, by Euler steps of a tenth of a sample."""
    time = np.arange(1500) / RATE
    force = 4 * np.sin(2 * np.pi * (0.3 + 0.04 * seed) * time) + 2 * np.sin(7 * time)
    speed, v = [], 0.0
    for now in force:
        speed.append(v)
        for _ in range(10):
            v += (now - 3.0 * v) / 2.0 / RATE / 10
    noise = np.random.default_rng(seed).normal(0, 0.005, len(time))
    return {"time[s]": time, "force[N]": force, "speed[m/s]": np.array(speed) + noise}


@pytest.fixture(autouse=True)
def drawn_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plots need no screen."""
    monkeypatch.setenv("MPLBACKEND", "Agg")


def as_pandas(table: dict[str, np.ndarray]) -> Any:
    import pandas as pd

    return pd.DataFrame(table)


def as_polars(table: dict[str, np.ndarray]) -> Any:
    return pl.DataFrame(table)


def as_xarray(table: dict[str, np.ndarray]) -> Any:
    import xarray as xr

    time, force, speed = table.values()
    return xr.Dataset(
        {"force": ("time", force, {"units": "N"}), "speed": ("time", speed, {"units": "m/s"})},
        coords={"time": ("time", time, {"units": "s"})},
    )


def as_times(table: dict[str, np.ndarray]) -> Any:
    import pandas as pd

    frame = pd.DataFrame(table).drop(columns="time[s]")
    frame.index = pd.date_range("2026-01-01", periods=len(frame), freq="10ms", name="time")
    return frame


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "slide.toml"
    path.write_text(MODEL)
    return str(path)


def test_the_steps_are_those_of_the_commands(
    emps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rigwatch.commands import main

    template = CONFIGS / "studies" / "emps.toml"
    study = rigwatch.Study.from_template(tmp_path / "study", template, emps)
    capsys.readouterr()
    assert main(["compare", str(study.folder)]) == 0
    shown = study.compare()
    assert repr(shown) == capsys.readouterr().out.rstrip("\n")
    assert shown._repr_html_().startswith("<pre>")
    assert study.add("coulomb").found.step == "add"
    assert study.compare().found.effects == ["coulomb@load"]
    assert repr(study).endswith("emps-force + coulomb@load")
    assert "coulomb" in repr(study.undo())
    assert study.compare().found.effects == []
    assert "by motion" in repr(study.locate())
    lines = (study.folder / "ledger.jsonl").read_text().splitlines()
    assert [json.loads(line)["step"] for line in lines] == ["new", "add", "undo"]


@pytest.fixture(scope="module")
def plain_error(tmp_path_factory: pytest.TempPathFactory) -> float:
    """The held-out error of the study of plain arrays."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "slide.toml").write_text(MODEL)
    data = {"one": run(1), "two": run(2)}
    study = rigwatch.Study.new(folder / "study", model=str(folder / "slide.toml"), data=data)
    return float(study.compare().found.held_out_error)


@pytest.mark.parametrize(
    "kind",
    [dict, as_pandas, as_times]
    + [pytest.param(kind, marks=pytest.mark.nightly) for kind in (as_polars, as_xarray)],
)
def test_a_table_of_any_kind_becomes_the_same_study(
    tmp_path: Path, model: str, plain_error: float, kind: Any
) -> None:
    data = {"one": kind(run(1)), "two": kind(run(2))}
    study = rigwatch.Study.new(tmp_path / "study", model=model, data=data)
    assert study.compare().found.held_out_error == pytest.approx(plain_error, rel=1e-6)


def test_from_arrays_to_the_missing_effect_and_back_to_data_frames(
    tmp_path: Path, model: str
) -> None:
    data = {"one": run(1), "two": run(2)}
    study = rigwatch.Study.new(tmp_path / "study", model=model, data=data)
    explained = study.explain()
    assert explained.found.verdict in {"missing_effect", "undetermined"}
    ranked = explained.table().to_pandas()
    assert "viscous" in set(ranked["effect"][:3])
    study.add("viscous")
    parameters = study.compare().table().to_polars()
    drag = parameters.filter(pl.col("parameter").str.contains("viscous"))["value"][0]
    assert drag == pytest.approx(3.0, rel=0.05)
    signals = study.signals().to_xarray()
    assert float(np.sqrt((signals["speed residual"] ** 2).mean())) == pytest.approx(0.005, rel=0.2)
    assert list(study.steps().to_pandas()["step"]) == ["model alone", "+ viscous"]
    drawn = [study.plot_signals(), study.plot_where("speed"), study.plot_steps()]
    assert [len(figure.axes) for figure in drawn] == [2, 1, 1]
    with pytest.raises(ModelError, match="found 'sped'; did you mean 'speed'"):
        study.plot_where("sped")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (3.0, "run: found float, expected arrays by name"),
        ({"force": [1.0, 2.0], "speed": [1.0]}, r"run: found force \(2,\), speed \(1,\)"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, model: str, table: object, words: str) -> None:
    with pytest.raises(ImportDataError, match=words):
        rigwatch.Study.new(tmp_path / "study", model=model, data={"run": table})
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda path: path.stem)
def test_the_notebooks_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), path.name, "exec"), names)


def test_the_package_loads_nothing_before_it_is_used() -> None:
    code = "import sys, rigwatch; print([m for m in ('numpy', 'numba') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_is_not_there_is_reported_with_those_that_are() -> None:
    with pytest.raises(AttributeError, match="Study"):
        _ = rigwatch.explains
