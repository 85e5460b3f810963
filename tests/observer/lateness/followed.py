"""The lateness of the inputs, followed along residuals made of known responses and noise."""

import numpy as np

from monitor.observer.lateness import input_lateness, no_lateness
from monitor.observer.missing_force import COLUMNS, DRY_UNIT, LATE_UNIT, E
from tests.compiled import from_python

follow_lateness = from_python(input_lateness.follow_lateness)

N, NOISE = 1024, 0.1
AT = 2.0 * np.pi * np.arange(N) / 32.0
LATE, DRY = 2.0 * np.sin(AT), -4.0 * np.sign(np.sin(AT + 0.4))
"""Responses to inputs late by one sample, and to dry friction."""


def learnt(
    error: np.ndarray,
    *,
    dry: np.ndarray = DRY,
    kept: np.ndarray | None = None,
    judging: bool = False,
) -> np.ndarray:
    """The carried figures after a residual, where `dry` is the response to dry friction."""
    rows = np.zeros((N, len(COLUMNS)))
    rows[:, E] = error + NOISE * np.random.default_rng(8).standard_normal(N)
    rows[:, LATE_UNIT], rows[:, DRY_UNIT] = LATE, dry
    kept = no_lateness() if kept is None else kept
    for row in rows:
        follow_lateness(row, NOISE**2, NOISE**2, judging, True, False, kept)
    return kept
