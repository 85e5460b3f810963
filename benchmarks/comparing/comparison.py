"""rigwatch and the users of four libraries on the same data: error, time, lines, physics.

Each user gets the training recordings and a linear model of second order, and predicts the held-out
recordings in free runs from their first samples. SciPy and CasADi fit what the user writes: once
the linear model, once with the missing physics, which the user is assumed to know. pysindy and
SysIdentPy search terms, rigwatch searches effects.

    python -m benchmarks comparison
    python -m benchmarks.comparing.page
"""

import ast
import importlib
import importlib.util
import json
import multiprocessing
import os
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Empty
from typing import Any

from benchmarks.comparing.task import Task, coarse, rms_error, tasks
from tools.benchmark_table import Row

LIMIT = float(os.environ.get("COMPARISON_LIMIT", "600"))
"""Time given to each user and data set [s]."""
NEEDED = {"casadi": "casadi", "pysindy": "pysindy", "sysidentpy": "sysidentpy"}
USERS = ("rigwatch", "scipy, linear", "scipy", "casadi, linear", "casadi", "pysindy", "sysidentpy")


@dataclass(frozen=True)
class Cell:
    """One user's result on one data set.

    Attributes:
        task, user: their names.
        error: of the held-out free runs in the task's shown unit; infinite if it diverges or did
            not end in time.
        seconds: wall time of fit and prediction.
        named: what the result says about the physics.
        lines: lines of code or of files that the user wrote.
    """

    task: str
    user: str
    error: float
    seconds: float
    named: str
    lines: int


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    chosen = tasks()[:1] if quick else tasks()
    return [
        Row(f"{cell.task}: {cell.user}", _in_words(cell, task), "", "", cell.named, None)
        for task in chosen
        for cell in cells(task)
    ]


def _in_words(cell: Cell, task: Task) -> str:
    return f"{cell.error:.3g} {task.shown[0]} in {cell.seconds:.3g} s"


def cells(task: Task) -> list[Cell]:
    """Results of all users whose library is installed."""
    return [_limited(task, user) for user in USERS if _installed(user)]


def _installed(user: str) -> bool:
    """Whether the user's library is there; if not, one line says how to get it."""
    package = NEEDED.get(user.partition(",")[0])
    if package is None or importlib.util.find_spec(package):
        return True
    print(f"{user}: not installed; pip install -r requirements/bench.txt, or pip install {package}")
    return False


def _limited(task: Task, user: str) -> Cell:
    """A user's result from a process of its own, which is ended at the limit."""
    spawned = multiprocessing.get_context("spawn")
    results = spawned.Queue()
    process = spawned.Process(target=_work, args=(task.name, user, results))
    process.start()
    try:
        found: dict[str, Any] = results.get(timeout=LIMIT)
    except Empty:
        named = f"not finished in {LIMIT:.0f} s"
        found = {"error": float("inf"), "seconds": LIMIT, "named": named}
        process.kill()
    process.join()
    return Cell(task.name, user, lines=_lines(task, user), **found)


def _work(name: str, user: str, results: Any) -> None:
    """Fit and predict; the task is made here, as its functions cannot be sent."""
    task = next(each for each in tasks() if each.name == name)
    begin = time.perf_counter()
    try:
        error, named = _result(task, user)
    except Exception as failure:  # one user's failure is a result
        error, named = float("inf"), f"failed: {failure}".splitlines()[0][:80]
    seconds = time.perf_counter() - begin
    results.put({"error": error * task.shown[1], "seconds": seconds, "named": named})


def _result(task: Task, user: str) -> tuple[float, str]:
    tool, _, linear = user.partition(", ")
    module = importlib.import_module(f"benchmarks.comparing.with_{tool}")
    if tool == "rigwatch":
        with tempfile.TemporaryDirectory() as folder:
            error, named = module.found_by(task, Path(folder))
        return error, named
    if tool == "sysidentpy":
        runs, named = module.found_by(task)
        return rms_error(task, runs), named
    at = task if tool == "casadi" else coarse(task)  # CasADi is fast enough for all samples
    if tool == "pysindy":
        runs, named = module.found_by(at)
        return rms_error(at, runs), named
    runs = module.predictions(at, () if linear else task.terms)
    return rms_error(at, runs), "no" if linear else f"written by the user: {task.words}"


def _lines(task: Task, user: str) -> int:
    """Lines that the user writes: statements of the program, or the study and its model."""
    tool = user.partition(",")[0]
    if tool == "rigwatch":
        module = importlib.import_module("benchmarks.comparing.with_rigwatch")
        return int(module.lines_written(task))
    source = Path(__file__).with_name(f"with_{tool}.py").read_text(encoding="utf-8")
    return _code_lines(source)


def _code_lines(source: str) -> int:
    """Lines of code without imports, comments, blank lines and docstrings."""
    tree = ast.parse(source)
    documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
    words = [
        n.body[0] for n in ast.walk(tree) if isinstance(n, documented) and ast.get_docstring(n)
    ]
    left_out = {row for n in words for row in range(n.lineno, (n.end_lineno or n.lineno) + 1)}
    left_out |= {n.lineno for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)}
    return sum(
        bool(line.strip()) and not line.strip().startswith("#") and row not in left_out
        for row, line in enumerate(source.splitlines(), 1)
    )


def stored(path: Path, chosen: list[Task]) -> list[Cell]:
    """All cells, stored one by one; those that the file has already are not computed again."""
    known = [Cell(**json.loads(x)) for x in path.read_text().splitlines()] if path.exists() else []
    have = {(cell.task, cell.user) for cell in known}
    with path.open("a", encoding="utf-8") as file:
        for task in chosen:
            for user in USERS:
                if (task.name, user) not in have and _installed(user):
                    known.append(_limited(task, user))
                    file.write(json.dumps(asdict(known[-1])) + "\n")
                    file.flush()
    return known
