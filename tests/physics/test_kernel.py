"""A compiled function is kept between runs, compiled anew when anything in it has changed, and
borrows the arrays that it is given.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core.errors import NumbaError

from rigwatch.wire.kernel import kernel, part

CALLER = """
import called as parts
from called import FACTOR, scaled
from rigwatch.wire.kernel import kernel

@kernel()
def result(x: float) -> float:
    return FACTOR * scaled(x) + parts.OFFSET

print(result(1.0), sum(result.stats.cache_hits.values()))
"""
CALLED = """
import numpy as np
from rigwatch.wire.kernel import part

FACTOR, OFFSET, WEIGHTS = 2.0, 0.0, np.array([1.0, 2.0])

@part()
def scaled(x):
    return deeper(x) * WEIGHTS[1]

@part()
def deeper(x):
    return x + 1.0
"""


def run(folder: Path) -> list[str]:
    # A source of the same size and second as its bytecode would pass for unchanged.
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    environment["PYTHONPATH"] = os.pathsep.join([str(folder), *sys.path])
    done = subprocess.run(
        [sys.executable, str(folder / "caller.py")],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    return done.stdout.split()


CHANGES = [
    ("x + 1.0", "x + 2.0"),
    ("FACTOR, OFFSET, WEIGHTS = 2.0", "FACTOR, OFFSET, WEIGHTS = 3.0"),
    ("2.0, 0.0,", "2.0, 4.0,"),
    ("[1.0, 2.0]", "[1.0, 3.0]"),
]
"""Each makes 12 of 8."""


@pytest.mark.nightly
def test_what_another_file_holds_is_part_of_the_key(tmp_path: Path) -> None:
    (tmp_path / "caller.py").write_text(CALLER)
    called = tmp_path / "called.py"
    called.write_text(CALLED)
    assert run(tmp_path) == ["8.0", "0"]
    for before, after in CHANGES:
        called.write_text(CALLED.replace(before, after))
        assert run(tmp_path) == ["12.0", "0"], after
    called.write_text(CALLED)
    assert run(tmp_path) == ["8.0", "1"]


HOLDER = """
from typing import NamedTuple
import numpy as np

class Before(NamedTuple):
    held: np.ndarray
"""
USER = """
import numpy as np
from called import Before
from rigwatch.wire.kernel import kernel

@kernel()
def result(state):
    return state.held[0]

print(result(Before(np.ones(1))), sum(result.stats.cache_hits.values()))
"""


def test_a_cache_that_names_a_class_that_is_gone_is_written_anew(tmp_path: Path) -> None:
    for name, hits in (("Before", "0"), ("After", "0"), ("After", "1")):
        (tmp_path / "called.py").write_text(HOLDER.replace("Before", name))
        caller = tmp_path / "caller.py"
        if not caller.exists() or name not in caller.read_text():
            caller.write_text(USER.replace("Before", name))
        assert run(tmp_path) == ["1.0", hits]


def test_a_part_is_compiled_once_for_all_constants() -> None:
    @part()
    def power(x: float, times: int) -> float:
        found = 1.0
        for _ in range(times):
            found *= x
        return found

    @njit()
    def total(x: float, most: int) -> float:
        return power(x, 2) + power(x, times=3) + power(x, most)

    assert total(2.0, 4) == 2.0**2 + 2.0**3 + 2.0**4
    assert len(power.signatures) == 1


def test_what_borrows_returns_no_array() -> None:
    @kernel()
    def same(rows: np.ndarray) -> np.ndarray:
        return rows

    @kernel()
    def first_row(rows: np.ndarray) -> np.ndarray:
        return rows[0]

    with pytest.raises(TypeError, match="same returns an array: it has to say `allocates`"):
        same(np.ones((2, 3)))
    with pytest.raises(NumbaError):
        first_row(np.ones((2, 3)))


def test_what_borrows_makes_no_array() -> None:
    @kernel()
    def total(x: np.ndarray) -> float:
        return float(np.zeros(3)[0] + x[0])

    with pytest.raises(NumbaError, match="No implementation of function"):
        total(np.ones(2))


def test_what_is_given_an_array_to_keep_allocates_too() -> None:
    @part(allocates=True)
    def doubled(x: np.ndarray) -> np.ndarray:
        return 2.0 * x

    @kernel()
    def borrowing(x: np.ndarray) -> float:
        return doubled(x)[0]

    @kernel(allocates=True)
    def allocating(x: np.ndarray) -> float:
        return doubled(x)[0]

    with pytest.raises(TypeError, match=r"doubled, which returns an array, `allocates` too"):
        borrowing(np.ones(2))
    assert allocating(np.ones(2)) == 2.0


def test_arrays_that_were_borrowed_are_freed() -> None:
    @part(allocates=True)
    def summed(rows: np.ndarray) -> float:
        return (rows[0] + rows[1]).sum()

    @kernel()
    def total(rows: np.ndarray, out: np.ndarray) -> None:
        out[0] = summed(rows[1:])

    rows, out = np.ones((3, 4)), np.zeros(1)
    before = sys.getrefcount(rows)
    for _ in range(100):
        total(rows, out)
    assert out[0] == 8.0
    assert sys.getrefcount(rows) == before
