"""The wheel: every module and data file, and the example configurations that the demo needs."""

import zipfile
from pathlib import Path

import pytest
from hatchling.build import build_wheel

ROOT = Path(__file__).parents[2]
PACKAGES = ("daq", "monitor", "rigwatch", "sim_plant")


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    folder = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        name = build_wheel(str(folder))
    with zipfile.ZipFile(folder / name) as wheel:
        return set(wheel.namelist())


def test_it_holds_every_module_and_data_file(contents: set[str]) -> None:
    files = [path for top in PACKAGES for path in (ROOT / top).rglob("*") if path.is_file()]
    kept = {str(path.relative_to(ROOT)) for path in files if "__pycache__" not in path.parts}
    assert kept <= contents


def test_it_holds_the_example_configurations(contents: set[str]) -> None:
    files = (ROOT / "configs").rglob("*.toml")
    assert {f"rigwatch/{path.relative_to(ROOT)}" for path in files} <= contents
