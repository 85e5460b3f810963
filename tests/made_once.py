"""What several files of tests need and takes seconds to make: one worker makes it for all."""

import fcntl
import os
import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
SHARED = "RIGWATCH_TESTS_SHARED"
"""Environment variable: a folder of this run alone, which `tests/conftest.py` makes."""


def made_once(make: Callable[[], T]) -> Callable[[], T]:
    """Decorator of a function without arguments whose result can be pickled, and is not changed.

    A worker that needs it while another makes it waits, and gives its core to the others.
    """

    @cache
    def found() -> T:
        path = Path(os.environ[SHARED], f"{make.__module__}.{make.__qualname__}")
        with path.open("a+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.seek(0)
            if kept := file.read():
                return pickle.loads(kept)  # type: ignore[no-any-return]
            made = make()
            file.write(pickle.dumps(made))
            return made

    return found
