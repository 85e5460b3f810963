"""The smallest kernel: if it compiles and is cached, so do all others."""

from numba import njit


@njit("float64(float64)", cache=True)
def add_one(value: float) -> float:
    """`value` plus one."""
    return value + 1.0
