"""Every command and every key of a configuration is documented."""

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.commands import _parser, every_command, main
from tools import config_docs

COMMANDS = [name for name, _ in every_command()]
ROOT = Path(__file__).parents[2]


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def pages() -> str:
    return "\n".join(page.read_text(encoding="utf-8") for page in PAGES)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_every_command_has_an_example_that_names_it(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_:
        main([*name.split()[1:], "--help"])
    assert exit_.value.code == 0
    said, _, example = capsys.readouterr().out.partition("example:")
    assert name in example
    replaced = re.findall(r"^  ([^\s-]\S*)", said, re.MULTILINE)
    assert all(word == word.upper() or word.startswith("{") for word in replaced)


@pytest.mark.parametrize("group", ["structure", "study"])
def test_help_of_a_group_names_each_sub_command(
    group: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([group, "--help"])
    said = capsys.readouterr().out
    actions = [name.split()[2] for name in COMMANDS if name.startswith(f"rigwatch {group} ")]
    assert len(actions) >= 6
    for action in actions:
        assert f"\n    {action}" in said


@pytest.mark.parametrize("words", ["structure --json modes", "structure modes --json"])
def test_json_may_stand_before_a_sub_command_or_after_it(
    words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(ROOT / "configs" / "structures" / "kabe_antenna.toml")
    assert main([*words.split(), file]) == 0
    assert len(json.loads(capsys.readouterr().out)["omega"]) == 8


def test_a_sub_command_that_is_missing_or_unknown_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(["study"])
    assert exit_.value.code == 2
    assert "ACTION" in capsys.readouterr().err
    for words, told in (
        (["study", "nwe", "emps"], "found command 'nwe'; did you mean 'new'?"),
        (["dmo"], "found command 'dmo'; did you mean 'demo' or 'undo' or 'model'?"),
        (["--json", "xyz"], "found command 'xyz', expected one of accept, ack, add, "),
    ):
        assert main(words) == 2
        assert capsys.readouterr().err.startswith(f"rigwatch: {told}")


def shown_commands(page: Path) -> Iterator[tuple[int, list[str]]]:
    """Line and words of each command in a block of code."""
    fenced, before = False, ""
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        fenced ^= line.lstrip().startswith("```")
        text, before = before + line.strip(), ""
        if not (fenced or line.startswith("    ")) or not text.startswith("rigwatch "):
            continue
        if text.endswith("\\"):
            before = text[:-1]
            continue
        for command in re.split(r"; (?=rigwatch )", text):
            yield number, shlex.split(command.rstrip(" &"), comments=True)[1:]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_understood_as_it_is_printed(
    page: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    for number, words in shown_commands(page):
        try:
            _parser(words).parse_args(words)
        except SystemExit:
            said = capsys.readouterr().err
            # Files and folders are the reader's.
            assert "found no such file" in said, f"{page.name}:{number}: {said}"


def test_the_pages_show_commands() -> None:
    assert sum(len(list(shown_commands(page))) for page in PAGES) > 100


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_in_the_readme_or_the_documentation(name: str) -> None:
    assert name in pages()


def test_every_key_of_a_configuration_has_a_description() -> None:
    assert config_docs.undocumented() == []


def test_help_is_quick_because_nothing_slow_is_imported() -> None:
    slow = ("numba", "zenoh", "rerun", "scipy", "pyarrow", "pymodbus", "numpy", "google.protobuf")
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


def test_the_list_of_effects_loads_no_compiler_and_no_solver() -> None:
    code = (
        "import sys, rigwatch.commands as c\n"
        "assert c.main(['effects', '--json']) == 0\n"
        "print([m for m in ('numba', 'scipy') if m in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["force"]
    assert done.stderr.split() == ["[]"]
