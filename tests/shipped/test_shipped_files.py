"""Example files are found by name, wherever rigwatch was installed, and copied out."""

from pathlib import Path

import pytest

from rigwatch.commands import main
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files.shipped import KINDS, find_file, shipped_names
from sim_plant.scenario import load_scenario

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_every_file_is_found_by_name_and_by_its_path_in_the_checkout(
    empty: Path, kind: str
) -> None:
    names = shipped_names(kind)
    assert names == sorted(path.stem for path in (CONFIGS / kind).glob("*.toml"))
    for name in names:
        for given in (name, f"{name}.toml", f"configs/{kind}/{name}.toml"):
            assert (
                find_file(given, kind).read_bytes()
                == (CONFIGS / kind / f"{name}.toml").read_bytes()
            )


def test_a_file_of_ones_own_comes_first(empty: Path) -> None:
    (empty / "emps").write_text("mine")
    assert find_file("emps", "studies") == Path("emps")
    assert find_file("elsewhere/emps.toml", "studies") == Path("elsewhere/emps.toml")


def test_a_folder_of_that_name_is_no_file(empty: Path) -> None:
    (empty / "emps").mkdir()
    assert find_file("emps", "studies").parent.name == "studies"


def test_near_names_are_reported(empty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ConfigError, match="epms: found no such file, expected a file or one of"):
        find_file("epms", "studies")
    with pytest.raises(SystemExit):
        main(["study", "new", "s", "--template", "epms"])
    assert "expected a file or one of emps" in capsys.readouterr().err


def test_a_scenario_is_found_by_name_outside_the_checkout(empty: Path) -> None:
    assert load_scenario("demo") == load_scenario("configs/scenarios/demo.toml")


def test_init_copies_all_and_writes_nothing_over(empty: Path) -> None:
    assert main(["init", "rig"]) == 0
    there = {p.relative_to(empty / "rig" / "configs") for p in (empty / "rig").rglob("*.toml")}
    assert there == {path.relative_to(CONFIGS) for path in CONFIGS.rglob("*.toml")}
    mine = empty / "rig" / "configs" / "demo.toml"
    mine.write_text("# mine")
    (empty / "rig" / "configs" / "story.toml").unlink()
    assert main(["init", "rig"]) == 0
    assert mine.read_text() == "# mine"
    assert (empty / "rig" / "configs" / "story.toml").is_file()
