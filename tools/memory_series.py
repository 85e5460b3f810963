"""Memory of processes over a long run: how fast it grows, and when it steps."""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


def memory_kb(pid: int) -> float:
    """Anonymous resident memory of a process [kB], NaN if it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return float("nan")
    found = [line.split()[1] for line in lines if line.startswith("RssAnon")]
    return float(found[0]) if found else float("nan")


STEP_KB, BESIDE = 400.0, 5
"""Least rise called a step [kB], and the looks on either side whose medians differ by it."""


@dataclass
class Memory:
    """Memory of processes, by name, after each session: (pid, kB)."""

    seen: dict[str, list[tuple[int, float]]] = field(default_factory=dict)

    def look(self, pids: Mapping[str, int]) -> None:
        """Note the memory of each process."""
        for name, pid in pids.items():
            self.seen.setdefault(name, []).append((pid, memory_kb(pid)))

    def growth(self, name: str, share: float = 0.5) -> tuple[float, float, int]:
        """Growth of the last process of that name over the last `share` of all looks.

        Returns:
            growth [%] by a straight line over those looks, memory at their end [MB], their number.
        """
        looks = self.seen[name]
        late = _of_last(looks[int(len(looks) * (1.0 - share)) :])
        if len(late) < 4:
            return float("nan"), late[-1] / 1e3 if late else float("nan"), len(late)
        slope, level = np.polyfit(np.arange(len(late)), late, 1)
        return float(100.0 * slope * len(late) / level), late[-1] / 1e3, len(late)

    def steps(self, name: str) -> list[tuple[int, float]]:
        """Rises that stay, of the last process of that name: (look, kB), the first look is 0.

        A rise that is gone within `BESIDE` looks, and one slower than that, is none.
        """
        looks = self.seen[name]
        kb = _of_last(looks)
        first, found = len(looks) - len(kb), list[tuple[int, float]]()
        at = BESIDE
        while at + BESIDE <= len(kb):
            rise = float(np.median(kb[at : at + BESIDE]) - np.median(kb[at - BESIDE : at]))
            if rise >= STEP_KB:
                found.append((first + at, rise))
                at += BESIDE - 1
            at += 1
        return found

    def write(self, path: Path) -> None:
        """All looks as a table: look, process, pid, kB."""
        with path.open("w", encoding="ascii", newline="") as file:
            table = csv.writer(file)
            table.writerow(["session", "process", "pid", "kb"])
            for name, looks in self.seen.items():
                table.writerows([i, name, pid, kb] for i, (pid, kb) in enumerate(looks))


def _of_last(looks: Iterable[tuple[int, float]]) -> list[float]:
    found = list(looks)
    return [kb for pid, kb in found if pid == found[-1][0]]
