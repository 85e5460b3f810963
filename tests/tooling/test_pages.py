"""The pages: printed ones are up to date, links lead somewhere, and files that are named exist."""

import ast
import re
from pathlib import Path

import pytest

from tools import docs, pictures

ROOT = Path(__file__).parents[2]
CODE = ("benchmarks", "daq", "monitor", "rigwatch", "sim_plant", "tests")
PICTURES = ROOT / "docs" / "pictures"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")
"""A link or a picture: file, empty for the same page, and heading."""
NAMED_FILE = re.compile(r"`((?:rigwatch|daq|monitor|sim_plant|benchmarks|tests|tools)/[\w/.-]+)`")
"""A file or folder of the repository in code style."""
STOP = re.compile(r"^\d+\. `([\w/]+\.py)` `([\w.]+)`", flags=re.MULTILINE)
"""A stop of a walk: file and function."""

every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", docs.PAGES)
def test_written_pages_say_what_their_source_says(name: str) -> None:
    assert text_of(ROOT / "docs" / name) == docs.PAGES[name](), "run `make docs`"


@pytest.mark.parametrize("source", sorted(PICTURES.glob("*.txt")), ids=lambda path: path.stem)
def test_pictures_are_drawn_from_their_descriptions(source: Path) -> None:
    drawn = pictures.read(source).svg()
    assert text_of(source.with_suffix(".svg")) == drawn, "run `make docs`"


def test_every_picture_is_shown_on_a_page() -> None:
    shown = "".join(map(text_of, PAGES))
    drawn = [path.name for path in PICTURES.iterdir() if path.suffix in (".svg", ".png")]
    assert [name for name in drawn if f"pictures/{name})" not in shown] == []


@every_page
def test_every_link_leads_to_a_file_and_a_heading_of_it(page: Path) -> None:
    links = [(page.parent / file if file else page, at) for file, at in LINK.findall(text_of(page))]
    assert [(str(file), at) for file, at in links if not leads_somewhere(file, at)] == []


def leads_somewhere(file: Path, heading: str) -> bool:
    return file.exists() and (not heading or heading in anchors(file))


def anchors(page: Path) -> set[str]:
    """Headings as links name them: lower case, hyphens for spaces, no other punctuation."""
    titles = re.findall(r"^#+ (.+)$", text_of(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@every_page
def test_every_file_that_is_named_exists(page: Path) -> None:
    assert [name for name in NAMED_FILE.findall(text_of(page)) if not (ROOT / name).exists()] == []


def test_every_room_is_named_in_the_architecture() -> None:
    page = text_of(ROOT / "docs" / "architecture.md")
    houses = [ROOT / top for top in ("daq", "monitor", "rigwatch", "sim_plant")]
    rooms = {file.parent for house in houses for file in house.rglob("__init__.py")}
    missing = [
        str(room.relative_to(ROOT))
        for room in rooms
        if not re.search(rf"`(?:\S*/)?{room.name}/?`", page) and room.name != "rigwatch"
    ]
    assert missing == []


def test_every_section_of_the_theory_that_code_cites_exists() -> None:
    theory = text_of(ROOT / "docs" / "theory.md")
    sections = set(re.findall(r"^#+ ([\d.]+) ", theory, flags=re.MULTILINE))
    sources = "".join(text_of(file) for top in CODE for file in (ROOT / top).rglob("*.py"))
    cited = set(re.findall(r"docs/theory\.md (\d(?:\.\d)?)", sources))
    assert cited
    assert cited <= sections


@pytest.mark.parametrize("title", ["A sample from the wire", "A study from the file"])
def test_a_walk_through_the_code_is_short_and_every_stop_exists(title: str) -> None:
    _, _, walk = text_of(ROOT / "CONTRIBUTING.md").partition(f"### {title}")
    stops = STOP.findall(walk.partition("\n#")[0])
    assert 8 <= len(stops) <= 12
    assert [name for file, name in stops if name not in defined(ROOT / file)] == []


def defined(path: Path) -> set[str]:
    """Names of a module's functions and methods: "run", "Monitor.update"."""
    body = ast.parse(text_of(path)).body
    functions = {node.name for node in body if isinstance(node, ast.FunctionDef)}
    return functions | {
        f"{node.name}.{inner.name}"
        for node in body
        if isinstance(node, ast.ClassDef)
        for inner in node.body
        if isinstance(inner, ast.FunctionDef)
    }
