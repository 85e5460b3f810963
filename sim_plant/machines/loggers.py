"""Logs as loggers write them: with rows lost, times that are uneven, clocks of their own.

    lost      a few holes of some rows each
    uneven    a loop in software: each tick is early or late, and commands are held until the next
    clock     a logger whose clock differs from the others' by up to a percent
    mixed     all of these at once

Plant and sensors are simulated at the times that the log states.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.machines.machine import Machine, log

LOGGERS = ("lost", "uneven", "clock", "mixed")
"""What real loggers do."""
HOLES, LONGEST = 3, 15
"""Number of holes in a log, and most rows of one."""
EARLIEST = 0.25
"""How early or late a tick is at most, in intervals."""
FASTEST, SLOWEST = 0.002, 0.01
"""Smallest and largest relative difference of a clock."""


def logged(
    machine: Machine, hidden: dict[str, float], noise: float, seed: int, logger: str
) -> dict[str, FloatArray]:
    """A recording as one of `LOGGERS` writes it, as by `log`.

    Args:
        machine: the machine; one without `any_clock` can lose rows only.
        hidden: strengths of the hidden effects, by name.
        noise: standard deviation of the sensors' noise, relative to the rms of their signals.
        seed: of excitation, noise and logger.
        logger: one of `LOGGERS`.

    Raises:
        ValueError: the logger is unknown, or the machine has a clock that cannot differ.
    """
    random = np.random.default_rng([seed, 2])
    if logger not in LOGGERS or (logger != "lost" and not machine.any_clock):
        raise ValueError(f"found logger {logger!r}, expected one of {LOGGERS} that suits the log")
    spans = None if logger == "lost" else _spans(machine, seed, logger, random)
    table = log(machine, hidden, noise, seed, spans)
    if logger in ("uneven", "clock"):
        return table
    kept = ~_holes(len(table["time_s"]), random)
    return {name: column[kept] for name, column in table.items()}


def _spans(machine: Machine, seed: int, logger: str, random: np.random.Generator) -> FloatArray:
    """Time from each sample to the next [s]."""
    count, interval = len(machine.drive(seed)), 1.0 / machine.rate
    spans = np.full(count, interval)
    if logger != "uneven":
        spans *= 1.0 + random.choice([-1.0, 1.0]) * random.uniform(FASTEST, SLOWEST)
    if logger != "clock":
        early = random.uniform(-EARLIEST, EARLIEST, count + 1)
        early[0] = 0.0
        spans += interval * np.diff(early)
    return spans


def _holes(count: int, random: np.random.Generator) -> np.ndarray:
    """Which rows of a log are lost."""
    lost = np.zeros(count, bool)
    for at in random.integers(count // 10, count - count // 10, HOLES):
        lost[at : at + random.integers(1, LONGEST + 1)] = True
    return lost
