"""Sessions made of the measured data sets, as a user would make them."""

import os
from pathlib import Path

import pytest

from rigwatch.commands import main

CONFIGS = Path(__file__).parents[2] / "configs"


def measured(*parts: str) -> Path:
    """A file of the measured data sets; in CI it must be there."""
    root = os.environ.get("RIGWATCH_DATA")
    if root is None and os.environ.get("CI") not in ("true", "1"):
        pytest.skip("RIGWATCH_DATA names no folder with the measured data sets")
    assert root is not None, "RIGWATCH_DATA is not set"
    return Path(root, *parts)


def imported(folder: Path, source: Path, name: str, mapping: str) -> None:
    arguments = ["import", str(source), str(folder / name)]
    assert main([*arguments, "--mapping", str(CONFIGS / "imports" / mapping)]) == 0


@pytest.fixture(scope="session")
def emps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with both recordings of EMPS."""
    folder = tmp_path_factory.mktemp("emps")
    imported(folder, measured("emps", "DATA_EMPS.mat"), "emps.mcap", "emps.toml")
    imported(
        folder, measured("emps", "DATA_EMPS_PULSES.mat"), "emps_pulses.mcap", "emps_pulses.toml"
    )
    return folder


@pytest.fixture(scope="session")
def silverbox(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the recording of the Silverbox."""
    folder = tmp_path_factory.mktemp("silverbox")
    imported(folder, measured("silverbox", "SNLS80mV.mat"), "silverbox.mcap", "silverbox.toml")
    return folder


@pytest.fixture(scope="session")
def cylinder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the recording of the pneumatic cylinder at 5 bar."""
    folder = tmp_path_factory.mktemp("cylinder")
    source = measured("pneumatic_cylinder", "O-ring257_5bar.csv")
    imported(folder, source, "cylinder.mcap", "pneumatic_cylinder.toml")
    return folder
