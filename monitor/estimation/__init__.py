"""Windowed sums behind the estimates (5.33)-(5.39), exact for any length of the run."""

from monitor.estimation.energies import (
    SIGNALS,
    Energies,
    add,
    energy,
    new_energies,
    recent_energy,
    restart_energies,
)
from monitor.estimation.window import (
    FILL,
    LENGTH,
    Window,
    new_window,
    push,
    restart_window,
    solve_two,
    sums,
)

__all__ = [
    "FILL",
    "LENGTH",
    "SIGNALS",
    "Energies",
    "Window",
    "add",
    "energy",
    "new_energies",
    "new_window",
    "push",
    "recent_energy",
    "restart_energies",
    "restart_window",
    "solve_two",
    "sums",
]
