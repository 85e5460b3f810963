"""Whoever gives a value for a parameter that is fitted is told so, and where the fit refutes it."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.workbench.compare import compare
from tests.workbench.dampers import stroke
from tests.workbench.machine import studied
from tests.workbench.studies.test_recordings_apart import DAMPER, UNITS


def free(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.zeros_like(v)


def remarks(folder: Path, given: str, unit: str = "N*s/m") -> list[str]:
    """What is said of the viscosity of a damper that has 3 N s/m."""
    model = DAMPER.replace('"N*s/m"', f'"{unit}"')
    keys = f"start = {{ c = {given} }}" if given else ""
    study = studied(folder, model, [stroke(0, free)], [stroke(1, free)], UNITS, keys)
    return [each for each in compare(study).remarks if each.startswith("c: fitted")]


@pytest.mark.parametrize(
    ("given", "unit", "said"),
    [
        pytest.param("0.3", "N*s/m", "the 0.3 N*s/m given", id="ten times as large"),
        pytest.param("30.0", "N*s/m", "the 30 N*s/m given", id="a tenth"),
        pytest.param("-3.0", "N*s/m", "the -3 N*s/m given", id="of the other sign"),
        pytest.param("0.0003", "kN*s/m", "the 0.0003 kN*s/m given", id="in the model's unit"),
        pytest.param("1.2", "N*s/m", "", id="a rough start"),
        pytest.param("0.003", "kN*s/m", "", id="right in the model's unit"),
        pytest.param("0.0", "N*s/m", "", id="no size"),
        pytest.param("", "N*s/m", "", id="not given"),
    ],
)
def test_a_fitted_value_of_another_order_than_the_given_one_is_told(
    tmp_path: Path, given: str, unit: str, said: str
) -> None:
    found = remarks(tmp_path, given, unit)
    assert len(found) == bool(said)
    if said:
        assert f"another order of magnitude than {said} under [start]" in found[0]


def test_a_new_study_says_that_a_given_value_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for seed in (0, 1):
        log = stroke(seed, free)
        rows = np.column_stack([np.arange(1200) / 100, log["x"], log["v"], log["force"]])
        head = "time [s],x [m],v [m/s],force [N]"
        np.savetxt(f"run{seed}.csv", rows, delimiter=",", header=head, comments="")
    Path("own.toml").write_text(DAMPER)
    new = ["study", "new", "made", "--data", "run0.csv", "run1.csv", "--model", "own.toml"]
    assert main([*new, "--set", "c=2.5"]) == 0
    assert "c: fitted, beginning at the value given" in "".join(capsys.readouterr())
    Path("own.toml").write_text(DAMPER.replace("value = 1.0,", "value = 1.0, fixed = true,"))
    new[2] = "held"
    assert main([*new, "--set", "c=2.5"]) == 0
    assert "beginning at the value given" not in "".join(capsys.readouterr())
