"""Parts of kernels, called from Python."""

from collections.abc import Callable
from typing import Any

from numba import njit


def from_python(part: Any) -> Callable[..., Any]:
    """A part, which only kernels call, compiled as a function that tests call."""
    entry: Callable[..., Any] = njit()(part.py_func)
    return entry
