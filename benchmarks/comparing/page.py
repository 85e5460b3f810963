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
find. *Lines*: of the program without imports and comments, or of model, study and commands.
"""
TAIL = """
Errors are of free runs, in which errors add up; rigwatch judges effects over horizons
([workbench](workbench.md)). SysIdentPy predicts samples of its decimated recording. EMPS is
sampled far faster than it moves: SciPy, pysindy and rigwatch's last fit get every tenth sample of
it, CasADi all. Measured on {processor}, {cores} cores, Python {python}, {date}, at load {load}.
"""


def table(task: Task, found: Sequence[Cell]) -> list[str]:
    """The rows of one data set."""
    unit = task.shown[0]
    lines = [
        f"\n## {task.name}: {task.words}\n",
        f"Missing in the linear model: {', '.join(task.effects)}. For comparison: {task.floor}.\n",
        f"| user | held-out error [{unit}] | time [s] | lines | physics named |",
        "| --- | --- | --- | --- | --- |",
    ]
    for cell in found:
        error = f"{cell.error:.3g}" if cell.error < float("inf") else "-"
        named, name = cell.named.replace("|", "\\|"), NAMES[cell.user]
        lines.append(f"| {name} | {error} | {cell.seconds:.3g} | {cell.lines} | {named} |")
    best = min(found, key=lambda cell: cell.error)
    fastest = min(found, key=lambda cell: cell.seconds)
    lines.append(f"\nSmallest error: {NAMES[best.user]}. Fastest: {NAMES[fastest.user]}.")
    return lines


def write(found: Sequence[Cell], chosen: Sequence[Task]) -> None:
    """Write the page of these results."""
    done = "\n".join(f"| {user} | {what} |" for user, what in DONE.items())
    lines = [HEAD.format(done=done).rstrip()]
    for task in chosen:
        lines += table(task, [cell for cell in found if cell.task == task.name])
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
