"""`rigwatch study view` writes every step of a study for the viewer."""

import json
from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.workbench.study.study import Study
from tests.report.drive import SAMPLES


def test_a_file_for_the_viewer_holds_every_step(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "drive.rrd"
    assert main(["study", "view", str(study.folder), "--save", str(target), "--json"]) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn == {
        "samples": SAMPLES, "steps": ["model alone", "+ coulomb", "+ constant force"],
    }  # fmt: skip
    # Measured, three modelled and three residuals of 8 bytes each, with their times.
    assert target.stat().st_size > 100_000
    content = target.read_bytes()
    for entity in (b"force/signals/measured", b"force/residual/model_alone",
                   b"force/signals/coulomb", b"force/residual/constant_force"):  # fmt: skip
        assert entity in content


def test_a_missing_folder_is_named_before_the_long_work(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "nowhere" / "drive.rrd"
    assert main(["study", "view", str(study.folder), "--save", str(target)]) != 0
    said = capsys.readouterr().err
    assert (
        said.strip()
        .splitlines()[-1]
        .endswith(f"{target}: found no folder {target.parent}, expected one to write to")
    )
    assert "Traceback" not in said
    assert "fitting" not in said
