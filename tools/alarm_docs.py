"""Writes the table of alarms in docs/alarms.md from the one in the code: `make docs`."""

import sys
from pathlib import Path

from monitor.alarms import ALARM_KINDS
from monitor.alarms.kinds import AlarmKind

TARGET = Path(__file__).parent.parent / "docs" / "alarms.md"
BEGIN = "<!-- Printed by `make docs` from the table in monitor/alarms/kinds.py. -->\n"
HEAD = """
| alarm | severity | persistence | clear after | latch | cause | what to do |
| --- | --- | --- | --- | --- | --- | --- |
"""


def page() -> str:
    """The page as it stands, with the table anew."""
    text, _, _ = TARGET.read_text(encoding="utf-8").partition(BEGIN)
    return text + BEGIN + HEAD + "".join(map(_row, ALARM_KINDS))


def _row(kind: AlarmKind) -> str:
    of = kind.defaults
    latch = "yes" if of.latch else "no"
    settings = f"{of.persistence} | {of.clear_after} | {latch}"
    return f"| `{kind.name}` | {kind.severity} | {settings} | {kind.cause} | {kind.guidance} |\n"


def main() -> int:
    """Write the page."""
    TARGET.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
