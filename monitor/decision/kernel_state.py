"""State of the decision kernel, and the indices of its outputs.

`WatchState.held` holds the newest value of every output; `counts` counts samples of the current
episode, from a departure until all statistics are quiet again.
"""

from typing import Any, NamedTuple

import numpy as np

from monitor.decision.isolation import History, new_history
from monitor.estimation import (
    SIGNALS,
    Energies,
    Window,
    new_energies,
    new_window,
    restart_energies,
    restart_window,
)
from monitor.reference import new_record
from monitor.signals import fill, fill_rows
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

NO_VERDICT, FRICTION, OTHER, STICKING, NEW_EXCITATION = 0, 1, 2, 3, 4

(
    MODELLED, RESIDUAL, CHANGE, SPEED, THETA1, THETA2, LOW1, HIGH1, LOW2, HIGH2,
    OBSERVABLE, ARMED_FLAG, DEVIATION, EXPLAINED, SHARE, REST, VERDICT, RHO, TOGETHER,
    CONDITION, MOVED_VOLTAGE, SPEED_RMS, LEARNT_HERE,
) = range(23)  # fmt: skip
OUTPUTS = 23
"""Number of outputs; the names above index `held` and the kernel's output, published ones first."""

_COUNTS = np.dtype(
    [
        ("episode", np.int64),  # samples since the departure
        ("quiet", np.int64),  # quiet samples
        ("agreed", np.int64),  # consecutive tests that found friction
        ("hop", np.int64),  # samples since the last estimate
        ("excited", np.int64),  # consecutive tests that found another excitation
        ("still", np.int64),  # samples since the position last moved
    ]
)
Y, X, V, A, S = range(5)
"""Signals whose energies are computed: change of the residual, of position, voltage and
acceleration against the healthy period, and the velocity itself.
"""
SHORT, LONG = 8, 64
"""Samples over which energies are tested: the short for impacts, the long for small changes."""


class Rules(NamedTuple):
    """Parameters of the departure test; `decision_rules.py` derives them."""

    window: int
    hop: int
    factor: float
    limit_8: float
    limit_64: float
    least_velocity: float
    worst_condition: float
    position_floor: float
    voltage_floor: float
    low1: float
    high1: float
    low2: float
    high2: float


class WatchState(NamedTuple):
    """Carried state: sliding sums, newest samples, counters, outputs and a sample's workspace."""

    window: Window
    energies: Energies
    history: History
    counts: Any
    held: FloatArray
    recent: FloatArray
    signals: FloatArray
    row: FloatArray
    sums: FloatArray


def new_watch_state(
    longest_window: int, friction_b: FloatArray, friction_a: FloatArray
) -> WatchState:
    """The initial state.

    Args:
        longest_window: capacity of the sliding least squares [samples].
        friction_b, friction_a: friction filter Ge, padded to equal length.
    """
    return WatchState(
        new_window(longest_window),
        new_energies(LONG),
        new_history(friction_b, friction_a),
        new_record(_COUNTS),
        np.zeros(OUTPUTS),
        np.zeros(10),
        np.zeros(SIGNALS),
        np.zeros(3),
        np.zeros(6),
    )


@part()
def clear(state: WatchState, window: int) -> None:
    """Reset to the initial state; the least squares then spans `window` samples."""
    restart_window(state.window, window)
    restart_energies(state.energies)
    fill_rows(state.history.rows, 0.0)
    counts = state.counts
    counts.episode = counts.quiet = counts.agreed = counts.hop = counts.excited = 0
    counts.still = 0
    fill(state.held, 0.0)
    fill(state.recent, 0.0)
