"""The workbench from Python: what the commands do, on results that show themselves."""

import subprocess
import sys
from pathlib import Path

import pytest

import rigwatch
from tests.workbench.conftest import CONFIGS


def test_a_cell_shows_what_the_command_prints(
    emps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rigwatch.commands import main

    folder = rigwatch.new(tmp_path / "study", CONFIGS / "studies" / "emps.toml", emps)
    capsys.readouterr()
    assert main(["compare", str(folder)]) == 0
    shown = rigwatch.compare(folder)
    assert repr(shown) == capsys.readouterr().out.rstrip("\n")
    assert shown._repr_html_().startswith("<pre>")
    assert rigwatch.add(folder, "coulomb").found.step == "add"
    assert rigwatch.compare(folder).found.effects == ["coulomb@load"]
    assert "coulomb" in repr(rigwatch.undo(folder))
    assert rigwatch.compare(folder).found.effects == []
    assert "by motion" in repr(rigwatch.locate(folder))


def test_the_package_loads_nothing_before_it_is_used() -> None:
    code = "import sys, rigwatch; print([m for m in ('numpy', 'numba') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_is_not_there_is_told_with_those_that_are() -> None:
    with pytest.raises(AttributeError, match="explain"):
        _ = rigwatch.explains
