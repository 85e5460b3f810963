"""Every command and every key of a configuration is documented."""

import ast
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from benchmarks import results_page
from rigwatch.commands import COMMANDS, main

ROOT = Path(__file__).parents[2]
PRINTED_PAGES = (
    ("alarms.md", "alarm_docs"),
    ("commands.md", "command_docs"),
    ("configuration.md", "config_docs"),
)
CODE = ("benchmarks", "daq", "monitor", "rigwatch", "sim_plant", "tests")
PICTURES = ROOT / "docs" / "pictures"
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")
"""A link or a picture: file, empty for the same page, and heading."""
NAMED_FILE = re.compile(r"`((?:rigwatch|daq|monitor|sim_plant|benchmarks|tests|tools)/[\w/.-]+)`")
"""A file or folder of the repository in code style."""

STOP = re.compile(r"^\d+\. `([\w/]+\.py)` `([\w.]+)`", flags=re.MULTILINE)
"""A stop of a walk: file and function."""


def load_tool(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def documents() -> list[Path]:
    return [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]


def pages() -> str:
    return "\n".join(page.read_text(encoding="utf-8") for page in documents())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_every_command_has_an_example_that_names_it(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_:
        main([name, "--help"])
    assert exit_.value.code == 0
    _, _, example = capsys.readouterr().out.partition("example:")
    assert f"rigwatch {name}" in example


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_in_the_readme_or_the_documentation(name: str) -> None:
    assert f"rigwatch {name}" in pages()


def test_every_key_of_a_configuration_has_a_description() -> None:
    assert load_tool("config_docs").undocumented() == []


@pytest.mark.parametrize(("page", "tool"), PRINTED_PAGES)
def test_printed_pages_say_what_the_code_says(page: str, tool: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert text == load_tool(tool).page(), "run `make docs`"


def test_the_page_of_the_benchmarks_shows_the_figures_that_are_kept() -> None:
    text = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert text == results_page.page(), "run `make docs`"


@pytest.mark.parametrize("source", sorted(PICTURES.glob("*.txt")), ids=lambda path: path.stem)
def test_pictures_are_drawn_from_their_descriptions(source: Path) -> None:
    drawn = load_tool("pictures").read(source).svg()
    assert source.with_suffix(".svg").read_text(encoding="utf-8") == drawn, "run `make docs`"


def test_every_link_of_a_page_leads_somewhere() -> None:
    lost = [
        f"{page.relative_to(ROOT)}: {target}#{heading}"
        for page in documents()
        for target, heading in LINK.findall(page.read_text(encoding="utf-8"))
        if not leads_somewhere(page.parent / target if target else page, heading)
    ]
    assert lost == []


def leads_somewhere(target: Path, heading: str) -> bool:
    """Whether the file exists, and the heading in it."""
    return target.exists() and (not heading or heading in anchors(target))


def anchors(page: Path) -> set[str]:
    """Headings as links name them: lower case, hyphens for spaces, no other punctuation."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


def test_every_file_that_a_page_names_exists() -> None:
    named = [
        f"{page.relative_to(ROOT)}: {name}"
        for page in documents()
        for name in NAMED_FILE.findall(page.read_text(encoding="utf-8"))
        if not (ROOT / name).exists()
    ]
    assert named == []


def test_every_section_of_the_theory_that_code_cites_exists() -> None:
    theory = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    sections = set(re.findall(r"^#+ ([\d.]+) ", theory, flags=re.MULTILINE))
    sources = [file for top in CODE for file in (ROOT / top).rglob("*.py")]
    cited = {
        number
        for file in sources
        for number in re.findall(r"docs/theory\.md (\d(?:\.\d)?)", file.read_text(encoding="utf-8"))
    }
    assert cited
    assert cited <= sections


@pytest.mark.parametrize("title", ["A sample from the wire", "A study from the file"])
def test_a_walk_through_the_code_is_short_and_every_stop_exists(title: str) -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    _, _, walk = text.partition(f"### {title}")
    stops = STOP.findall(walk.partition("\n#")[0])
    assert 8 <= len(stops) <= 12
    assert [name for file, name in stops if name not in defined(ROOT / file)] == []


def defined(path: Path) -> set[str]:
    """Names of a module's functions and methods: "run", "Monitor.update"."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)} | {
        f"{node.name}.{inner.name}"
        for node in classes
        for inner in node.body
        if isinstance(inner, ast.FunctionDef)
    }


def test_help_is_quick_because_nothing_slow_is_imported() -> None:
    slow = ("numba", "zenoh", "rerun", "scipy", "pyarrow", "pymodbus")
    code = (
        "import sys, rigwatch.commands as c\n"
        "try: c.main(['--help'])\n"
        f"except SystemExit: sys.exit(' '.join(m for m in {slow!r} if m in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.stderr.strip() == ""
    assert "COMMAND" in done.stdout
