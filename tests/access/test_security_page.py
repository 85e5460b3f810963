"""The page on security names every requirement of the standard once, and tests that exist."""

import re
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
REQUIREMENTS = (13, 12, 9, 3, 4, 2, 8)
"""System requirements of each of the seven foundational ones of IEC 62443-3-3."""
STATES = {"met", "partly", "machine", "not", "none here"}


def rows(heading: str) -> list[list[str]]:
    """The cells of the table below a heading, without its head."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_every_requirement_has_a_row_and_a_state() -> None:
    found = rows("IEC 62443-3-3")
    numbers = [re.match(r"SR (\d+\.\d+) ", row[0]) for row in found]
    wanted = chain(*([f"{a}.{b}" for b in range(1, n + 1)] for a, n in enumerate(REQUIREMENTS, 1)))
    assert [number[1] for number in numbers if number] == list(wanted)
    assert {row[1] for row in found} <= STATES
    assert all(row[2] for row in found if row[1] in ("met", "partly", "not"))


def test_every_threat_names_its_tests_or_none() -> None:
    for _, where, _, tests in rows("Threats"):
        named = re.findall(r"`(tests/[^`]+)`", tests)
        assert named or tests == "none", where
        assert all((ROOT / name).is_file() for name in named), where
