"""A new study says how many effects are tried, and an unknown one how the others are."""

from pathlib import Path

import numpy as np
import pytest
import scipy

from rigwatch.commands import main
from rigwatch.workbench.ranking import suitable
from rigwatch.workbench.study import open_study
from tests.workbench.studies.test_recordings_apart import DAMPER

WITH_OIL = DAMPER.replace("c*v -", "thickness*c*v -").replace(
    "outputs.", 'parameters.thickness = { value = 1.0, unit = "1", fixed = true }\noutputs.'
)
HINT = "rarer effects have not been tried"


def logged(path: Path, seed: int) -> str:
    """A damper that something else pushes at random, slowly."""
    draws = np.random.default_rng(seed).normal(size=(2, 1500))
    t = np.arange(1500) / 100
    x = 0.01 * (np.sin((2 + 0.3 * seed) * t) + np.sin(3.3 * t + 0.05 * t**2 + seed))
    v = np.gradient(x, 0.01)
    force = 3 * v + scipy.signal.lfilter([0.1], [1, -0.9], draws[0]) + 0.01 * draws[1]
    lines = ["time_s,x [m],v [m/s],force [N]"]
    lines += [",".join(f"{value:.6g}" for value in row) for row in zip(t, x, v, force, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return f"{path}"


def test_rarer_effects_are_counted_apart_and_offered_where_none_explains_the_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "damper.toml").write_text(WITH_OIL)
    logs = [logged(tmp_path / f"run{seed}.csv", seed) for seed in (1, 2)]
    folder, model = tmp_path / "study", tmp_path / "damper.toml"
    assert main(["study", "new", f"{folder}", "--data", *logs, "--model", f"{model}"]) == 0
    tried, rarer = suitable(open_study(folder))
    assert {"coulomb", "jenkins"} <= set(tried)
    assert {"maxwell_slip", "jenkins_behind_gap"} <= set(rarer)
    assert "radiation" not in {*tried, *rarer}
    said = f"{len(tried)} effects suit its ports, {len(rarer)} rarer ones with whole_library = true"
    assert said in capsys.readouterr().out

    assert main(["explain", f"{folder}"]) == 0
    out = capsys.readouterr().out
    assert "something is missing that no known effect explains" in out
    assert f"next: {len(rarer)} {HINT}" in out
    file = folder / "study.toml"
    own_value = f"set this machine's under [start] in {file}"
    assert f"note: thickness: taken from the model file; {own_value}" in out
    file.write_text(f"whole_library = true\n{file.read_text()}")
    assert suitable(open_study(folder))[1] == []
