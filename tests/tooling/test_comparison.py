"""The comparison with other libraries: what counts as written, errors of free runs, the page."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.comparing import comparison
from benchmarks.comparing.page import table
from benchmarks.comparing.task import coarse, rms_error, tasks


@pytest.fixture(scope="module")
def task():
    return tasks()[0]


def test_errors_are_of_every_or_every_nth_sample(task) -> None:
    whole = [part.y + 0.01 for part in task.held_out]
    assert rms_error(task, whole) == pytest.approx(0.01)
    assert rms_error(task, [run[::4] for run in whole]) == pytest.approx(0.01)
    assert rms_error(task, [run * np.inf for run in whole]) == float("inf")


def test_coarse_recordings_span_the_same_time(task) -> None:
    slow = coarse(replace(task, coarse=8))
    assert slow.dt * len(slow.train[0].y) == pytest.approx(task.dt * len(task.train[0].y))


def test_lines_of_code_are_counted_without_words_and_imports() -> None:
    body = 'def f() -> float:\n    """More."""\n    # why\n    return math.pi\n'
    source = f'"""Words."""\n\nimport math\n\n\n{body}'
    assert comparison._code_lines(source) == 2


def test_a_library_that_is_not_there_is_named_with_its_command(monkeypatch, capsys) -> None:
    monkeypatch.setattr(comparison.importlib.util, "find_spec", lambda _name: None)
    assert not comparison._installed("pysindy")
    assert "pip install pysindy" in capsys.readouterr().out
    assert comparison._installed("scipy, linear")


def test_the_page_says_who_is_better(task) -> None:
    cells = [
        comparison.Cell(task.name, "rigwatch", 2.0, 1.0, "coulomb@load", 20),
        comparison.Cell(task.name, "scipy", 1.0, 3.0, "written by the user", 30),
        comparison.Cell(task.name, "pysindy", float("inf"), 9.0, "v|v|", 40),
    ]
    lines = "\n".join(table(task, cells))
    assert "Smallest error: SciPy, physics known. Fastest: rigwatch." in lines
    assert "| pysindy | - | 9 | 40 | v\\|v\\| |" in lines
