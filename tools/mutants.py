"""Prints how many changes of each module the tests noticed: `make mutate`, after mutmut has run."""

import json
from collections import Counter
from pathlib import Path

FOLDER = Path("mutants")
NOTICED = {1: "killed", 3: "killed", **dict.fromkeys((24, -24, 36, 152, 255), "timeout")}
"""What pytest, the clock and the limit of processor time say of a mutant; all else survived."""


def counts(meta: Path) -> Counter[str]:
    """Mutants of one module by what became of them; those that were not run are left out."""
    codes = json.loads(meta.read_text("utf-8"))["exit_code_by_key"].values()
    return Counter(NOTICED.get(code, "survived") for code in codes if code is not None)


def main() -> None:
    """One line a module of which mutants have run."""
    print(f"{'module':42}{'mutants':>8}{'killed':>8}{'timeout':>8}{'survived':>9}{'noticed':>9}")
    for meta in sorted(FOLDER.rglob("*.meta")):
        if found := counts(meta):
            total, survived = found.total(), found["survived"]
            name = str(meta.relative_to(FOLDER).with_suffix(""))
            line = f"{name:42}{total:8}{found['killed']:8}{found['timeout']:8}{survived:9}"
            print(f"{line}{1 - survived / total:9.1%}")


if __name__ == "__main__":
    main()
