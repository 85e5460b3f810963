"""Memory of processes over a long run: how fast it grows, and when it steps."""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

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


PARTS = 10
"""Parts of a series whose rises are compared with each other."""


class Growth(NamedTuple):
    """Growth of a process's memory over some looks.

    Attributes:
        percent: by a straight line over them [%].
        unsure: two standard errors of it, from how much the rises between its parts differ: memory
            grows by steps, and the same process again would make them at other times [%].
        mb: memory at their end [MB].
        looks: their number.
        hours: from the first to the last of them [h].
    """

    percent: float
    unsure: float
    mb: float
    looks: int
    hours: float

    @property
    def an_hour(self) -> float:
        """The growth of an hour [%]."""
        return self.percent / self.hours if self.hours else float("nan")


@dataclass
class Memory:
    """Memory of processes, by name, after each session.

    Attributes:
        seen: of each process (pid, kB) at each look.
        at_s: time of each look [s].
    """

    seen: dict[str, list[tuple[int, float]]] = field(default_factory=dict)
    at_s: list[float] = field(default_factory=list)

    def look(self, pids: Mapping[str, int], at_s: float) -> None:
        """Note the memory of each process at a time [s]."""
        self.at_s.append(at_s)
        for name, pid in pids.items():
            self.seen.setdefault(name, []).append((pid, memory_kb(pid)))

    def growth(self, name: str, share: float = 0.5) -> Growth:
        """Growth of the last process of that name over the last `share` of all looks."""
        looks = self.seen[name]
        late = _of_last(looks[int(len(looks) * (1.0 - share)) :])
        unknown = float("nan")
        if len(late) < 4:
            return Growth(unknown, unknown, late[-1] / 1e3 if late else unknown, len(late), unknown)
        slope, level = np.polyfit(np.arange(len(late)), late, 1)
        percent = 100.0 * slope * len(late) / level
        hours = (self.at_s[-1] - self.at_s[-len(late)]) / 3600.0
        return Growth(float(percent), _unsure(late, level), late[-1] / 1e3, len(late), hours)

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


def _unsure(kb: list[float], level: float) -> float:
    """Two standard errors of the growth over a series [%]; NaN if it is too short."""
    if len(kb) < 2 * PARTS:
        return float("nan")
    rises = np.diff([part.mean() for part in np.array_split(np.array(kb), PARTS)])
    error = PARTS * np.std(rises, ddof=1) / np.sqrt(len(rises))
    return float(200.0 * error / level)


def _of_last(looks: Iterable[tuple[int, float]]) -> list[float]:
    found = list(looks)
    return [kb for pid, kb in found if pid == found[-1][0]]
