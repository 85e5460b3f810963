"""Prints docs/faults.md from tests/faults/catalogue.toml: `make docs` writes it."""

import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
CATALOGUE = ROOT / "tests" / "faults" / "catalogue.toml"
INTRODUCTION = """# Faults

<!-- Printed by `make docs` from tests/faults/catalogue.toml. -->

What can go wrong on a rig, what rigwatch does then, within which time, and the tests that inject
it: into a real pseudo-terminal, a real Modbus server, router and processes, real files.
[Alarms](alarms.md) lists the alarms. `tests/faults/catalogue.toml` names each test, and those of
defects that were found by probing.

Times are measured by sample numbers or by the system's own time stamps ("numbers", "stamps"),
otherwise by a stopwatch ("wall"). Where other work on a machine may delay a process for longer than
the time allowed, the best of up to three injections counts.
"""


def page() -> str:
    """The whole page."""
    table = tomllib.loads(CATALOGUE.read_text(encoding="utf-8"))
    faults = "".join(map(_fault, sorted(table["fault"], key=lambda row: int(row["number"]))))
    head = "| | where | fault | what rigwatch does | within | measured | tests |\n"
    rule = "| --- | --- | --- | --- | --- | --- | --- |\n"
    return f"{INTRODUCTION}\n{head}{rule}{faults}"


def tests_of(row: dict[str, Any]) -> list[str]:
    """The tests of a row, as pytest names them, without parameters."""
    return [str(test) for test in row["tests"]]


def _fault(row: dict[str, Any]) -> str:
    cells = (row["number"], row["layer"], row["fault"], row["does"], row["within"], row["measured"])
    return f"| {' | '.join((*map(str, cells), _links(row)))} |\n"


def _links(row: dict[str, Any]) -> str:
    """The files of a row's tests, each once."""
    paths = dict.fromkeys(test.partition("::")[0] for test in tests_of(row))
    return "<br>".join(f"[{Path(path).stem}](../{path})" for path in paths)
