"""Rooms are entered through their fronts, and no folder grows beyond what a newcomer can read."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HOUSES = {
    "daq",
    "monitor",
    "sim_plant",
    "rigwatch",
    "rigwatch.browser",
    "rigwatch.commands",
    "rigwatch.dashboard",
    "rigwatch.physics",
    "rigwatch.physics.engine",
    "rigwatch.structures",
    "rigwatch.wire",
    "rigwatch.workbench",
}
"""Packages that only hold rooms: their modules may be imported from anywhere."""
MOST_FILES = 15
CODE = sorted(
    path
    for top in ("daq", "monitor", "sim_plant", "rigwatch")
    for path in (ROOT / top).rglob("*.py")
)


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {_name(path): path for path in CODE}
PACKAGES = {name for name, path in MODULES.items() if path.name == "__init__.py"}


def _imported(path: Path) -> Iterator[tuple[int, str]]:
    """Line and module of each import."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.lineno, node.module
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)


def _room(name: str) -> str | None:
    """The outermost room that a module stands in, None for a module of a house."""
    parts = name.split(".")
    packages = (".".join(parts[:end]) for end in range(1, len(parts) + 1))
    return next((p for p in packages if p in PACKAGES and p not in HOUSES), None)


def _trespasses(path: Path) -> Iterator[str]:
    for line, target in _imported(path):
        room = _room(target) if target in MODULES else None
        if room and target != room and _room(_name(path)) != room:
            yield f"{path.relative_to(ROOT)}:{line} imports {target}, expected {room}"


@pytest.mark.parametrize("path", CODE, ids=_name)
def test_a_room_is_imported_through_its_front(path):
    assert list(_trespasses(path)) == []


def test_a_front_only_shows_what_the_room_offers():
    for room in PACKAGES - HOUSES:
        tree = ast.parse(MODULES[room].read_text("utf-8"))
        assert ast.get_docstring(tree), room
        shown = (ast.Expr, ast.ImportFrom, ast.Assign)
        assert all(isinstance(node, shown) for node in tree.body), room


def test_no_folder_holds_more_files_than_one_reads_at_a_glance():
    beside = (path for top in ("tests", "benchmarks") for path in (ROOT / top).rglob("*.py"))
    folders = {path.parent for path in (*CODE, *beside)}
    sizes = {
        folder: len([p for p in folder.glob("*.py") if p.name != "__init__.py"])
        for folder in folders
    }
    assert {f"{f.relative_to(ROOT)}: {n}" for f, n in sizes.items() if n > MOST_FILES} == set()


def _needed(path: Path) -> set[str]:
    """Modules of the code that a file imports, also within functions and for types alone."""
    names = set[str]()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    names |= {name for _, name in _imported(path)}
    return names & MODULES.keys() - PACKAGES


def test_no_files_import_each_other_in_a_circle():
    files = {name: _needed(path) for name, path in MODULES.items() if name not in PACKAGES}
    try:
        TopologicalSorter(files).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_no_test_imports_a_benchmark():
    """Benchmarks stand on the tests' helpers and on the plants, never the other way round."""
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in (ROOT / "tests").rglob("*.py")
        for line, name in _imported(path)
        if name.split(".")[0] == "benchmarks"
    ]
    assert found == []


def _house(name: str) -> str:
    """The package of a process, or of a subject of rigwatch."""
    parts = name.split(".")
    return ".".join(parts[: 2 if parts[0] == "rigwatch" else 1])


def test_no_two_files_of_one_house_share_a_name():
    counted: dict[tuple[str, str], list[str]] = {}
    for name, path in MODULES.items():
        if path.stem not in ("__init__", "__main__"):
            counted.setdefault((_house(name), path.stem), []).append(name)
    assert [names for names in counted.values() if len(names) > 1] == []
