"""The structure of the code: no circle of imports, and folders that can be taken in at a glance."""

import ast
from collections import Counter
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("rigwatch", "monitor", "daq", "sim_plant", "benchmarks", "tools")
MOST_FILES = 15


def modules() -> dict[str, Path]:
    """Files of code by dotted name; the front of a folder, `__init__`, has the folder's."""
    files = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    return {".".join(file.relative_to(ROOT).with_suffix("").parts): file for file in files}


def imported(file: Path, known: dict[str, Path]) -> set[str]:
    """Modules that a file imports anywhere, also within functions and for types alone."""
    names = set[str]()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names & known.keys()


def test_no_files_import_each_other_in_a_circle() -> None:
    known = modules()
    try:
        TopologicalSorter({n: imported(f, known) for n, f in known.items()}).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


@pytest.mark.parametrize("package", [*PACKAGES, "tests"])
def test_no_folder_has_more_files_of_code_than_one_takes_in(package: str) -> None:
    files = [f for f in (ROOT / package).rglob("*.py") if f.name != "__init__.py"]
    crowded = {
        str(folder.relative_to(ROOT)): count
        for folder, count in Counter(file.parent for file in files).items()
        if count > MOST_FILES
    }
    assert crowded == {}
