"""Common parts of the benchmarks of hidden effects: stored results, shares, confusion matrix."""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec

from rigwatch.wire.errors import RigwatchError
from tools.benchmark_table import Row


class Judged(Protocol):
    """An outcome with its case."""

    @property
    def case(self) -> Any:
        """The case."""
        ...


Outcome = TypeVar("Outcome", bound=Judged)


def asked(description: str | None) -> argparse.ArgumentParser:
    """The command line of a benchmark that stores its results one by one."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--results", type=Path, required=True, help="file of JSON lines")
    parser.add_argument("--effect", action="append", help="this effect alone, may be repeated")
    parser.add_argument("--share", type=float, action="append", help="this share alone")
    parser.add_argument("--seed", type=int, action="append", help="this seed alone")
    parser.add_argument("--minutes", type=float, default=1e9, help="start no case after these")
    return parser


def wanted(case: Any, chosen: argparse.Namespace) -> bool:
    """Whether the command line selects a case with these hidden effects, share and seed."""
    return (
        (not chosen.effect or ("+".join(case.hidden) or "healthy") in chosen.effect)
        and (not chosen.share or case.share in chosen.share or not case.hidden)
        and (not chosen.seed or case.seed in chosen.seed)
    )


def collected(
    path: Path,
    kind: type[Outcome],
    cases: Iterable[Any],
    solve: Callable[[Any], Outcome],
    *,
    said: Callable[[Outcome], str],
    minutes: float,
) -> list[Outcome]:
    """All outcomes of a file of JSON lines; missing cases are run and appended."""
    found: list[Outcome] = []
    if path.exists():
        lines = path.read_text("utf-8").splitlines()
        found = [msgspec.json.decode(line, type=kind) for line in lines]
    done, begin = {outcome.case for outcome in found}, time.monotonic()
    with path.open("a", encoding="utf-8") as file:
        for case in cases:
            if case in done or time.monotonic() - begin > 60 * minutes:
                continue
            try:
                outcome = solve(case)
            except RigwatchError as error:
                print(case, error, flush=True)
                continue
            found.append(outcome)
            file.write(msgspec.json.encode(outcome).decode() + "\n")
            file.flush()
            print(said(outcome), flush=True)
    return found


def share_row(what: str, hits: Sequence[bool], bar: float | None, note: str) -> Row:
    """A row that says how many of all hit, against the bar if there is one."""
    passed = None if not hits or bar is None else sum(hits) >= bar * len(hits)
    share = f" = {sum(hits) / len(hits):.1%}" if hits else ""
    said = "" if bar is None else f"≥ {100 * bar:g}%"
    return Row(what, f"{sum(hits)}/{len(hits)}{share}", said, "", note, passed)


def counted(names: Iterable[str]) -> str:
    """The most frequent names with their numbers."""
    return ", ".join(f"{name}: {count}" for name, count in Counter(names).most_common(12))


def confusion(pairs: Iterable[tuple[tuple[str, ...], str]]) -> str:
    """The confusion matrix as lines: hidden effects, and how often each name was given."""
    table: dict[str, Counter[str]] = {}
    for hidden, called in pairs:
        table.setdefault("+".join(hidden) or "healthy", Counter())[called] += 1
    width = max((len(name) for name in table), default=0)
    lines = [
        f"{name:{width}}  " + ", ".join(f"{called} {n}" for called, n in found.most_common())
        for name, found in sorted(table.items())
    ]
    return "\n".join(lines)
