"""A model file in mm and ms is identified, guessed and printed in its own units."""

import json
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main

MODEL = """
name = "swing"
summary = "A mass that swings on a spring."
inputs = {}
[states.x]
unit = "mm"
derivative = "v"
start = 20.0
measured = "x"
[states.v]
unit = "m/s"
derivative = "-(k*x + c*v)/m"
[parameters.m]
value = 2.0
unit = "kg"
fixed = true
[parameters.c]
value = 0.001
unit = "N s/mm"
fixed = true
[parameters.k]
value = 0.2
unit = "N/mm"
[outputs.x]
unit = "mm"
expression = "x"
"""


@pytest.mark.parametrize("guess", [[], ["--unknown", "k=0.2"]])
def test_a_stiffness_in_newtons_per_millimetre(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], guess: list[str]
) -> None:
    model, record = tmp_path / "swing.toml", tmp_path / "swing.csv"
    model.write_text(MODEL)
    t = np.arange(600) * 0.01
    decay = 1.0 / (2 * 2.0)
    omega = np.sqrt(240.0 / 2.0 - decay**2)
    x = 0.02 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    np.savetxt(record, np.column_stack([t, x]), delimiter=",", header="t,x", comments="")
    command = ["structure", "identify", str(model), str(record), *guess]
    assert main([*command, "--json"]) == 0
    k = json.loads(capsys.readouterr().out)["parameters"]["k"]
    assert k["unit"] == "N/mm"
    assert k["value"] == pytest.approx(0.24, rel=1e-4)
    assert k["interval"][0] <= k["value"] <= k["interval"][1]
    assert main(command) == 0
    assert "] N/mm" in capsys.readouterr().out
