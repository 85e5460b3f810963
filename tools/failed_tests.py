"""Tests that failed in the last run of pytest, one a line, as pytest takes them from a file.

python -m tools.failed_tests > failed.txt && pytest @failed.txt      # 1 if none is recorded

`pytest --last-failed` cannot be used: pytest-xdist records the tests of a group with the group's
name appended, and another run knows no test of that name.
"""

import json
import sys
from pathlib import Path

RECORD = Path(".pytest_cache/v/cache/lastfailed")


def failed_tests(record: Path = RECORD) -> list[str]:
    """Names of the tests that failed, without their groups; empty where nothing is recorded."""
    try:
        recorded = json.loads(record.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return []
    return [_without_group(name) for name in recorded]


def _without_group(name: str) -> str:
    test, at, group = name.rpartition("@")
    return test if at and "]" not in group else name


if __name__ == "__main__":
    found = failed_tests()
    print("\n".join(found))
    sys.exit(not found)
