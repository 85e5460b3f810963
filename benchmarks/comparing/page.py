"""Prints docs/comparison.md from one run of the comparison.

    python -m benchmarks.comparing.page [RESULTS.jsonl]

Results are stored one by one; those that the file has are not computed again.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.__main__ import machine
from benchmarks.comparing.comparison import Cell, stored
from benchmarks.comparing.task import Task, tasks

TARGET = Path(__file__).parents[2] / "docs" / "comparison.md"
NAMES = {
    "rigwatch": "rigwatch",
    "scipy, linear": "SciPy, linear model",
    "scipy": "SciPy, physics known",
    "casadi, linear": "CasADi, linear model",
    "casadi": "CasADi, physics known",
    "pysindy": "pysindy",
    "sysidentpy": "SysIdentPy",
}
DONE = {
    "rigwatch": "a study of logs and a model file; `explain` and `add` while an effect is named"
    " with confidence; for EMPS first force from its motion, as its study is shipped",
    "SciPy": "the equation in Python, `solve_ivp` and `least_squares`, on growing parts of the"
    " recording",
    "CasADi": "Runge-Kutta steps mapped over the samples, multiple shooting with a Gauss-Newton"
    " Hessian, IPOPT",
    "pysindy": "smoothed derivatives; polynomials, sign and square of the speed; STLSQ with a"
    " threshold from validation",
    "SysIdentPy": "polynomial NARX, FROLS with Akaike's criterion; lags and degree from a free run"
    " for validation",
}
HEAD = """<!-- Printed by `python -m benchmarks.comparing.page`. -->

# Comparison

What do users of SciPy, CasADi, pysindy and SysIdentPy do with the same recordings? Each starts from
a linear model of second order, fits the training recordings, and predicts the held-out ones in free
runs from their first samples. The programs are in
[benchmarks/comparing](../benchmarks/comparing), written after each library's documentation.

| user | what the user does |
| --- | --- |
{done}

*Physics known*: the user has written the missing terms, which is what the other tools are asked to
find. *Lines*: of the program without imports and comments, or of model, study and commands. Bold is
the smallest error or the shortest time of a row, whosever it is.
"""
TAIL = """
Errors are of free runs, in which errors add up; rigwatch judges effects over horizons
([workbench](workbench.md)). SysIdentPy predicts samples of its decimated recording. EMPS is
sampled far faster than it moves: SciPy, pysindy and rigwatch's last fit get every tenth sample of
it, CasADi all. Measured on {processor}, {cores} cores, Python {python}, {date}, at load {load}.
"""


def table(found: Sequence[Cell], chosen: Sequence[Task]) -> list[str]:
    """One table: three rows a data set, a column a user; the best of a row is bold."""
    users = [user for user in NAMES if any(cell.user == user for cell in found)]
    lines = [
        f"| data set | | {' | '.join(NAMES[user] for user in users)} |",
        f"| --- | --- |{' --- |' * len(users)}",
    ]
    for task in chosen:
        cells = {cell.user: cell for cell in found if cell.task == task.name}
        own = [cells.get(user) for user in users]
        errors = [cell.error if cell else float("inf") for cell in own]
        times = [cell.seconds if cell and cell.error < float("inf") else None for cell in own]
        missing = f"{task.name}; missing: {task.words}; {task.floor}"
        lines += [
            _row(missing, f"held-out error [{task.shown[0]}]", [_number(e) for e in errors]),
            _row("", "time [s]", [_number(each) for each in times]),
            _row("", "lines", [str(cell.lines) if cell else "-" for cell in own], mark=False),
            _row("", "physics named", [_named(cell) for cell in own], mark=False),
        ]
    return lines


def _number(value: float | None) -> str:
    return "-" if value is None or value == float("inf") else f"{value:.3g}"


def _named(cell: Cell | None) -> str:
    """What a user's result says of the physics, short enough for a column."""
    if cell is None:
        return "not installed"
    named = cell.named.replace("|", "\\|")
    return "given by the user" if named.startswith("written by the user") else named


def _row(name: str, what: str, cells: Sequence[str], *, mark: bool = True) -> str:
    """A row of the table, with its smallest number bold."""
    numbers = [float(cell) for cell in cells if mark and cell != "-"]
    least = min(numbers, default=None)
    shown = [
        f"**{cell}**" if mark and cell != "-" and float(cell) == least else cell for cell in cells
    ]
    return f"| {name} | {what} | {' | '.join(shown)} |"


def summary(found: Sequence[Cell], chosen: Sequence[Task]) -> str:
    """Who is best in what, in a sentence for each data set."""
    told = []
    for task in chosen:
        ended = [c for c in found if c.task == task.name and c.error < float("inf")]
        if ended:
            best = NAMES[min(ended, key=lambda cell: cell.error).user]
            fastest = NAMES[min(ended, key=lambda cell: cell.seconds).user]
            told.append(f"* {task.name}: smallest error {best}, fastest {fastest}.")
    return "\n".join(told)


def write(found: Sequence[Cell], chosen: Sequence[Task]) -> None:
    """Write the page of these results."""
    done = "\n".join(f"| {user} | {what} |" for user, what in DONE.items())
    lines = [HEAD.format(done=done), *table(found, chosen), "", summary(found, chosen)]
    TARGET.write_text("\n".join(lines) + "\n" + TAIL.format(**machine()), "utf-8")


def main() -> int:
    """0 if the page is written."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "cells.jsonl"
        chosen = tasks()
        write(stored(place, chosen), chosen)
    return 0


if __name__ == "__main__":
    sys.exit(main())
