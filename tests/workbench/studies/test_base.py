"""`rigwatch study base`: the healthy recordings choose among a model's variants."""

import json
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.workbench.compare import find_base
from rigwatch.workbench.study.study import open_study
from tests.workbench.machine import studied, with_healthy
from tests.workbench.studies.test_own_model import PORT, SPEED, UNITS, run

VARIANTS = """
[variants.rubbing]
physics = "A healthy rotor rubs."
parameters.d = { value = 0.1, unit = "rad/s^2", low = 0.0, fixed = true, kept = true }
states.v = { unit = "rad/s", derivative = "-a*v + b*u - d*tanh(v/slow) + load", measured = "v" }
parameters.slow = { value = 0.02, unit = "rad/s", fixed = true }

[variants.no_drag]
physics = "Nothing holds the rotor back in proportion to its speed."
without = ["a"]
states.v = { unit = "rad/s", derivative = "b*u + load", measured = "v" }
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    found = studied(tmp_path, SPEED + PORT + VARIANTS, [run(0)], [run(1)], UNITS)
    return with_healthy(found, run(2), UNITS).folder


def test_the_variant_that_the_rig_has_is_enough_is_taken_and_undone(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "base", str(study), "--take", "enough", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["enough"]["variants"] == ["rubbing"]
    assert found["ranking"][0]["variants"] == ["rubbing"]
    assert found["enough"]["over_noise"] < 1.2 < found["ranking"][-1]["over_noise"]
    assert open_study(study).file.variants == ("rubbing",)
    assert "d" in open_study(study).model.parameters

    assert main(["study", "show", str(study)]) == 0
    assert "with rubbing: A healthy rotor rubs." in capsys.readouterr().out
    assert main(["undo", str(study)]) == 0
    assert open_study(study).file.variants == ()
    assert main(["study", "replay", str(study)]) == 0


def test_the_noise_of_resampled_recordings_is_that_of_the_band_that_they_keep(
    study: Path,
) -> None:
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(f"rate = 80.0\n{text}")
    assert find_base(open_study(study)).enough.over_noise < 1.2


def test_what_cannot_be_taken_is_one_line(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "base", str(study), "--take", "rubbing,no_drag"]) != 0
    assert "expected one of them" in capsys.readouterr().err
    text = (study / "study.toml").read_text().partition("[[healthy]]")[0]
    (study / "study.toml").write_text(text)
    assert main(["study", "base", str(study)]) != 0
    assert "found no healthy recording, expected one: record a run" in capsys.readouterr().err
