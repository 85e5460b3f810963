"""Prints the table of docs/alarms.md from `monitor/alarms/kinds.py`: `make docs` writes it."""

from pathlib import Path

from monitor.alarms.kinds import ALARM_KINDS, AlarmKind

PAGE = Path(__file__).parent.parent / "docs" / "alarms.md"
BEGIN = "<!-- Printed by `make docs` from monitor/alarms/kinds.py. -->\n"
END = "<!-- End of the printed table. -->\n"
HEADINGS = ("alarm", "severity", "persistence", "clear after", "latch", "cause", "what to do")


def page() -> str:
    """The whole page: the text as it stands, with the table as the code has it."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


def table() -> str:
    """One line an alarm."""
    rows = [HEADINGS, ("---",) * len(HEADINGS), *map(_cells, ALARM_KINDS)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cells(kind: AlarmKind) -> tuple[str, ...]:
    defaults = kind.defaults
    return (
        f"`{kind.name}`",
        kind.severity,
        str(defaults.persistence),
        str(defaults.clear_after),
        "yes" if defaults.latch else "no",
        kind.cause,
        kind.guidance,
    )
