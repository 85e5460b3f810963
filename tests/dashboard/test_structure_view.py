"""`rigwatch structure` draws what it found for the viewer."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rigwatch.commands import main
from rigwatch.dashboard.board import palette

KABE = Path(__file__).parents[2] / "configs" / "structures" / "kabe_antenna.toml"


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("record") / "damaged.csv"
    damage = ["--damage", "4", "springs.k4_46.stiffness=50"]
    made = ["structure", "simulate", str(KABE), str(path), "--duration", "6", "--noise", "0.02"]
    assert main([*made, *damage]) == 0
    return path


@pytest.mark.nightly
def test_a_damage_is_drawn_with_its_test_instant_and_verdict(record: Path, tmp_path: Path) -> None:
    target = tmp_path / "damage.rrd"
    known = ["structure", "damage", str(KABE), str(record), "--known"]
    assert main([*known, "--save", str(target)]) == 0
    content = target.read_bytes()
    for part in (b"/x6/signals/measured", b"/x6/signals/with_the_damage_found",
                 b"/x6/residual/3_sigma", b"/test/statistic", b"/test/threshold", b"/test/k4_46",
                 b"k4_46 softer at"):  # fmt: skip
        assert part in content


@pytest.mark.nightly
def test_an_identification_is_drawn_as_a_picture(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The viewer's notices may be in the picture.
    monkeypatch.setattr("rigwatch.dashboard.viewer.picture._FRAMES", 8)
    target = tmp_path / "antenna.png"
    assert main(["structure", "identify", str(KABE), str(record), "--picture", str(target)]) < 2
    pixels = np.asarray(Image.open(target).convert("RGB")).astype(int)
    for colour in (palette.SIGNATURE, palette.OTHERS[0]):
        assert (np.abs(pixels - np.array(colour)).max(axis=2) < 40).sum() > 300, colour


@pytest.mark.parametrize("option", ["--save", "--picture"])
def test_a_file_that_cannot_be_written_is_one_plain_line(
    option: str, record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = str(tmp_path / "no" / "file")
    assert main(["structure", "identify", str(KABE), str(record), option, target]) == 2
    assert "found no folder" in capsys.readouterr().err
