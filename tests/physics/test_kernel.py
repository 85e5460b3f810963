"""A compiled function is kept between runs, and compiled anew when anything in it has changed."""

import os
import subprocess
import sys
from pathlib import Path

from numba import njit

from rigwatch.wire.kernel import part

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
