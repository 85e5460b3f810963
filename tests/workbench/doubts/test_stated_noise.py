"""A study states the noise of its sensors, where what is missing fills all bands of the error."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.compare.preparation import Bench, open_bench
from rigwatch.workbench.explain.explain import explained
from rigwatch.workbench.study.study import open_study
from tests.workbench.dampers import damper

NOISE = 0.2


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A damper whose friction follows a fine pattern along its way, as no effect does."""
    made = damper(
        tmp_path_factory.mktemp("damper"), lambda x, v: 3 * np.sin(20_000 * x) * np.sign(v)
    )
    return made.folder


def stating(folder: Path, noise: str) -> Bench:
    """The study of the damper with a line in its file."""
    file = folder / "study.toml"
    before = file.read_text(encoding="utf-8")
    try:
        file.write_text(f"{noise}\n{before}", encoding="utf-8")
        return open_bench(open_study(folder))
    finally:
        file.write_text(before, encoding="utf-8")


def test_what_fills_all_bands_passes_for_noise_until_the_noise_is_stated(folder: Path) -> None:
    assert explained(stating(folder, "")).explanation.verdict == "nothing_missing"

    bench = stating(folder, f"noise = {{ force = {NOISE} }}")

    assert bench.floor.method == "stated"
    assert bench.floor.rms == pytest.approx([NOISE])
    assert not bench.floor.lower_limit
    told = explained(bench).explanation
    assert told.verdict == "unknown_effect"
    assert told.comparison.noise_floor == pytest.approx(NOISE)


def test_it_is_in_the_unit_in_which_the_output_is_shown(folder: Path) -> None:
    bench = stating(folder, 'shown = { force = "mN" }\nnoise = { force = 200.0 }')
    assert bench.floor.rms == pytest.approx([NOISE])


def test_noise_that_the_recording_does_not_show_is_remarked_on(folder: Path) -> None:
    assert not stating(folder, f"noise = {{ force = {NOISE} }}").data.remarks
    (remark,) = stating(folder, "noise = { force = 20.0 }").data.remarks
    assert remark.startswith("noise: force = 20 N is stated, and its quietest band shows 2")


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("noise = { fource = 0.2 }", "noise: found output 'fource'; did you mean 'force'?"),
        ("noise = { force = 0.0 }", "noise.force: found 0.0, expected a number > 0"),
    ],
)
def test_what_is_stated_wrongly_is_told(folder: Path, line: str, problem: str) -> None:
    with pytest.raises(RigwatchError) as told:
        stating(folder, line)
    assert problem in str(told.value)
