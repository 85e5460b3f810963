"""Writes the pages of `docs/` that the code, or a file of the repository, is the source of.

`make docs` runs it; `tests/tooling/test_pages.py` compares each page with what this would write.
"""

import sys
from pathlib import Path

from tools import (
    alarm_docs,
    benchmark_page,
    command_docs,
    config_docs,
    effect_docs,
    fault_docs,
    format_docs,
    unit_docs,
)

FOLDER = Path(__file__).parent.parent / "docs"
PAGES = {
    "alarms.md": alarm_docs.page,
    "benchmarks.md": benchmark_page.page,
    "commands.md": command_docs.page,
    "configuration.md": config_docs.page,
    "effects.md": effect_docs.page,
    "faults.md": fault_docs.page,
    "file-formats.md": format_docs.page,
    "units.md": unit_docs.page,
}


def main() -> int:
    """Write the pages, unless a key of a configuration lacks its description."""
    missing = config_docs.undocumented()
    if missing:
        print(f"without a description: {', '.join(missing)}", file=sys.stderr)
        return 1
    for name, page in PAGES.items():
        (FOLDER / name).write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
