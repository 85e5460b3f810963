"""The fault catalogue is complete: faults and findings in order, each with tests."""

import ast
import tomllib
from functools import cache
from pathlib import Path

import pytest

from tools import fault_docs

ROOT = Path(__file__).parents[2]
TABLE = tomllib.loads(fault_docs.CATALOGUE.read_text(encoding="utf-8"))
ROWS = [*TABLE["fault"], *TABLE["finding"]]
MEASURED = {"numbers", "stamps", "wall", "-"}


@cache
def names_in(path: str) -> frozenset[str]:
    """Names of the test functions that pytest collects in a file."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return frozenset(
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    )


def test_every_fault_and_every_finding_is_listed_once() -> None:
    assert [row["number"] for row in TABLE["fault"]] == list(range(1, 66))
    assert [row["number"] for row in TABLE["finding"]] == list(range(1, 80))


@pytest.mark.parametrize(
    "row", ROWS, ids=lambda row: f"{row['number']}-{row.get('layer', 'found')}"
)
def test_every_row_has_tests_that_exist(row: dict[str, object]) -> None:
    tests = fault_docs.tests_of(row)
    assert tests
    assert len(set(tests)) == len(tests)
    for test in tests:
        path, name = test.split("::")
        assert Path(path).name.startswith("test_"), "or pytest does not collect it"
        assert name in names_in(path), test


@pytest.mark.parametrize("row", TABLE["fault"], ids=lambda row: str(row["number"]))
def test_every_fault_says_what_happens_and_how_its_time_is_measured(row: dict[str, str]) -> None:
    assert row["does"]
    assert row["within"]
    assert set(row["measured"].split(", ")) <= MEASURED
