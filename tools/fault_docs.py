"""Prints docs/faults.md from tests/faults/catalogue.toml: `make docs` writes it."""

import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
CATALOGUE = ROOT / "tests" / "faults" / "catalogue.toml"
INTRODUCTION = """# Faults

<!-- Printed by `make docs` from tests/faults/catalogue.toml. -->

What can go wrong on a rig, what rigwatch does then, within which time, and the test that injects
it: into a real pseudo-terminal, a real Modbus server, router and processes, real files.
[Alarms](alarms.md) lists the alarms.

Times are compared by sample numbers or by stamps that the system itself gives ("numbers",
"stamps"), else by a stopwatch ("wall"). Where other work on a machine may delay a process for
longer than the time allowed, the best of up to three injections counts: delays only lengthen it.
"""
FINDINGS = """
## Found by probing

Each was found on an earlier version; the test fails on the code of that time.

"""


def page() -> str:
    """The whole page."""
    table = tomllib.loads(CATALOGUE.read_text(encoding="utf-8"))
    faults = "".join(map(_fault, sorted(table["fault"], key=lambda row: int(row["number"]))))
    found = "".join(map(_finding, table["finding"]))
    head = "| | where | fault | what rigwatch does | within | measured | test |\n"
    rule = "| --- | --- | --- | --- | --- | --- | --- |\n"
    short = "| | found | test |\n| --- | --- | --- |\n"
    return f"{INTRODUCTION}\n{head}{rule}{faults}{FINDINGS}{short}{found}"


def tests_of(row: dict[str, Any]) -> list[str]:
    """The tests of a row, as pytest names them, without parameters."""
    return [str(test) for test in row["tests"]]


def _fault(row: dict[str, Any]) -> str:
    cells = (row["number"], row["layer"], row["fault"], row["does"], row["within"], row["measured"])
    return _line((*map(str, cells), _links(row)))


def _finding(row: dict[str, Any]) -> str:
    return _line((str(row["number"]), row["found"], _links(row)))


def _line(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |\n"


def _links(row: dict[str, Any]) -> str:
    return "<br>".join(_link(*test.split("::")) for test in tests_of(row))


def _link(path: str, name: str) -> str:
    return f"[{name.removeprefix('test_').replace('_', ' ')}](../{path})"
