"""The smallest kernel: whether it can be compiled and kept tells about all others."""

from numba import njit


@njit("float64(float64)", cache=True)
def add_one(value: float) -> float:
    """`value` plus one."""
    return value + 1.0
