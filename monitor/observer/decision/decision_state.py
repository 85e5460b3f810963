"""State and outputs of the observer's decision."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.drives import no_edges, no_instants
from monitor.model import HealthyLimits
from monitor.observer.lateness import no_lateness
from monitor.observer.missing_force import high_pass
from rigwatch.wire.arrays import FloatArray

SHORT, MEDIUM, LONG, LASTING = 8, 32, 128, 256
"""Window lengths [samples]: of jump detection, estimates, naming, and small lasting changes as well
as the force that is told."""
RISING = 2
"""Samples after a reversal during which real friction still changes sign."""
HISTORY = LASTING + RISING
SUMS = 13
"""Number of sums over a motion that was not recorded, see `window_statistics.add_unrecorded`."""
WAKE = 256
"""Samples after a jump of a channel during which filters and hidden states settle."""

ARMING, JUDGING, BEYOND = 0.0, 1.0, 2.0
"""Modes: hidden states settling; armed; motion outside the fitted range."""
UNNAMED, FRICTION, STICKING, OTHER = 0.0, 1.0, 2.0, 3.0
"""Verdicts."""

OUTPUTS = (
    "mode", "deviation", "force", "viscous", "named_force", "share", "dry_share", "rest",
    "verdict", "sensors", "spread", "departed", "amplitude", "deviations", "evidence",
    "lateness",
)  # fmt: skip
(
    MODE, DEVIATION, FORCE, VISCOUS, NAMED_FORCE, SHARE, DRY_SHARE, REST,
    VERDICT, SENSORS, SPREAD, DEPARTED, AMPLITUDE, DEVIATIONS, EVIDENCE,
    FOUND_LATE,
) = range(len(OUTPUTS))  # fmt: skip

USUAL_LASTING, USUAL_SHORT, USUAL_MEDIUM, USUAL_FRICTION, USUAL_ONSET = range(5)
"""Rows of the healthy residual's extremes at the present motion, see `usual_error.Extremes`."""

(
    ERROR, DRY, WET, LEVEL, DISAGREE, MEASURED, DRIVEN, DELAYED, READ, UNDECIDED, SPEED,
    BARE, LEVELS,
) = range(13)  # fmt: skip
"""Columns of the history; from `LEVELS` on, the levels on which the healthy variance depends, and
behind them the remainder's terms."""


class Counts(NamedTuple):
    """Indices of `DecisionState.counts`."""

    head: int = 0
    filled: int = 1
    since_start: int = 2
    quiet: int = 3
    beyond: int = 4
    since_onset: int = 5
    since_departed: int = 6
    agreed: int = 7
    disagreed: int = 8
    since_change: int = 9
    above: int = 10
    since_jump: int = 11
    judging: int = 12
    lasted: int = 13
    since_known: int = 14
    since_gap: int = 15
    since_whole: int = 16


AT = Counts()
(
    HEAD, FILLED, SINCE_START, QUIET, OUTSIDE, ONSET, DEPARTURE_AGO, AGREED, DISAGREED, CHANGED,
    ABOVE, JUMP_AGO, WAS_JUDGING, LASTED, KNOWN_AGO, GAP_AGO, WHOLE_AGO,
) = range(17)  # fmt: skip
"""Indices of `Counts` as constants for the kernel."""


class DecisionState(NamedTuple):
    """Carried state.

    Args:
        rows: the last samples, shape (HISTORY, LEVELS + levels + terms of the remainder).
        counts: see `Counts`; since_onset is -1 without an episode.
        value: verdict, named force, and energies of the drive recently and before.
        lasting: the last judged energies, relative to their limit, shape (LASTING,).
        sums: over a motion that was not recorded, shape (SUMS,).
        lateness: of the inputs, see `lateness`.
        edges: of the inputs, see `monitor.drives.edge_choice`.
        instants: of edges that jitter, see `monitor.drives.read_instants`.
        judged: outputs of the last sample that was judged, shape (outputs,).
    """

    rows: FloatArray
    counts: NDArray[np.int64]
    value: FloatArray
    lasting: FloatArray
    sums: FloatArray
    lateness: FloatArray
    edges: FloatArray
    instants: FloatArray
    judged: FloatArray


def new_state(levels: int, terms: int = 0) -> DecisionState:
    """The initial state.

    Args:
        levels: number of levels on which the healthy variance depends.
        terms: number of the remainder's terms of which the information is known.
    """
    count = np.zeros(len(AT), np.int64)
    count[AT.since_onset] = -1
    count[AT.since_jump] = WAKE
    rows = np.zeros((HISTORY, LEVELS + levels + terms))
    lasting, sums = np.zeros(LASTING), np.zeros(SUMS)
    inputs = no_lateness(), no_edges(), no_instants()
    return DecisionState(rows, count, np.zeros(4), lasting, sums, *inputs, np.zeros(len(OUTPUTS)))


PASSED = np.array([[1.0, 0.0, 0.0]] * 2)
"""The high-pass of signals that are judged as they are."""
NOT_KNOWN = np.zeros((0, 0))
"""The information of a remainder whose weights may be known or not."""


class DecisionRules(NamedTuple):
    """Decision thresholds; energies are relative to the healthy variance, see `HealthyLimits`.

    `unseen` is what the limits' energies grow by where a healthy rig's are not known, `high_pass`
    numerator and denominator of that of the judged signals, shape (2, 3), and `information` the RᵀR
    of the remainder's weights, shape (terms, terms); (0, 0) if it is not known.
    """

    noise: float
    growth: FloatArray
    short: float
    medium: float
    friction: float
    sensor_noise: float
    sensor_growth: float
    sensor: float
    speed_noise: float
    settle: int
    patience: int
    lasting: float
    unseen: float = 1.0
    high_pass: FloatArray = PASSED
    information: FloatArray = NOT_KNOWN


MARGIN = 1.6
"""Amplitude ratio of a threshold to the largest value of healthy recordings."""


def rules_of(
    limits: HealthyLimits, rate: float, corner: float, information: FloatArray
) -> DecisionRules:
    """Rules of a rig.

    Args:
        limits: of the healthy rig.
        rate: sample rate [Hz].
        corner: above which signals are judged [Hz].
        information: of the remainder's weights, see `DecisionRules`.
    """
    energy = MARGIN**2
    return DecisionRules(
        limits.noise,
        np.array(limits.growth),
        limits.short * energy,
        limits.medium * energy,
        limits.friction * MARGIN,
        limits.sensor_noise,
        limits.sensor_growth,
        limits.sensor * energy,
        limits.speed_noise,
        round(SETTLE * rate),
        round(PATIENCE * rate),
        energy,
        max(limits.unseen**2 / energy, 1.0),
        np.array(high_pass(corner, rate)),
        information,
    )


SETTLE, PATIENCE = 1.0, 0.75
"""Settling time of hidden states and filters, and time in which friction shows [s]."""
