"""The loop over samples of the observer's decision: inputs, history, departure, mode, episode.

    e ─▶ energies of a short and a medium window ─┐
    e, g ─▶ Coulomb and viscous force (window) ───┼▶ departure ─▶ episode ─▶ verdict
    e, g ─▶ evidence of the onset of dry friction ┤
    two views of the measured output ─────────────┘

Energies are relative to the healthy variance n² + κ·A, with A mean squares and fourth powers of the
motion and of the prediction, since the equations' error grows with the motion.
"""
# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np
from numpy.typing import NDArray

from monitor.drives import still_unsure, undecided
from monitor.observer.decision.decision_state import (
    ARMING,
    BARE,
    BEYOND,
    CHANGED,
    DELAYED,
    DEPARTURE_AGO,
    DEVIATION,
    ERROR,
    FILLED,
    GAP_AGO,
    HEAD,
    HISTORY,
    JUDGING,
    JUMP_AGO,
    LEVELS,
    LONG,
    MEDIUM,
    MODE,
    ONSET,
    OTHER,
    OUTSIDE,
    QUIET,
    READ,
    SINCE_START,
    SPEED,
    UNDECIDED,
    UNNAMED,
    WAKE,
    WAS_JUDGING,
    WHOLE_AGO,
    DecisionRules,
    DecisionState,
)
from monitor.observer.decision.deviation import departs, deviate
from monitor.observer.decision.inputs import follow_inputs
from monitor.observer.decision.naming import follow_episode, name_unrecorded
from monitor.observer.decision.window_statistics import SEEN
from monitor.observer.lagged_motion import EMPTY, FIRST, TAINTED
from monitor.observer.lateness import TAU, forget_lateness, response_to
from monitor.observer.missing_force import DRY_BARE, HELD_LATE, LATE_UNIT, MOVED, UNSURE_INPUT
from monitor.signals import Codes, fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

SUDDEN, LATE, BEFORE = 8.0, 16.0, 256.0
"""Ratio of the drive's energy over `LATE` samples to that over `BEFORE` above which the drive has
just started or increased, and the motion is not steady.
"""


@kernel()
def decide(  # noqa: PLR0917 -- a kernel
    judged: FloatArray,
    speed: FloatArray,
    levels: FloatArray,
    drive: FloatArray,
    inside: NDArray[np.bool_],
    jumped: NDArray[np.bool_],
    steady: NDArray[np.bool_],
    usual: FloatArray,
    response: FloatArray,
    altered: FloatArray,
    state: Codes,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Fill the columns of `OUTPUTS`, shape (outputs, n), sample by sample.

    `levels` holds those on which the healthy variance depends and, behind them, the terms of the
    remainder if the rules have the information of their weights.
    """
    for k in range(state.size):
        if state[k] == EMPTY:
            continue
        if state[k] == FIRST:
            _restart(kept)
        _follow_drive(drive[k], steady[k], kept)
        kept.counts[GAP_AGO] = 0 if state[k] == TAINTED else kept.counts[GAP_AGO] + 1
        both, before = judged[k, LATE_UNIT], judged[k, HELD_LATE]
        judged[k, LATE_UNIT] = response_to(both, before, kept.lateness)
        if state[k] != TAINTED:
            follow_inputs(kept, judged[k], usual[:, k], altered[k], rules)
            _remember(kept, judged[k], speed[k], levels[k])
        _follow_jumps(jumped[k], kept)
        if state[k] == TAINTED:
            _hold(k, kept, out)
        else:
            _judge(k, inside[k], usual[:, k], response[k], rules, kept, out)


@part()
def _restart(kept: DecisionState) -> None:
    fill(kept.counts, 0)
    kept.counts[ONSET] = -1
    kept.counts[JUMP_AGO] = WAKE
    fill(kept.value, 0.0)
    kept.value[0] = UNNAMED
    forget_lateness(kept.lateness)
    fill(kept.edges, 0.0)
    fill(kept.instants, 0.0)
    fill(kept.judged, 0.0)


@part()
def _follow_drive(energy: float, steady: bool, kept: DecisionState) -> None:
    """Detect a sudden start or increase of the drive; or it is known not to be steady."""
    late, before = kept.value[2], kept.value[3]
    late += (energy - late) / LATE
    before += (energy - before) / BEFORE
    kept.counts[CHANGED] += 1
    if late > SUDDEN * before + 1e-4 or not steady:
        kept.counts[CHANGED] = 0
    kept.value[2], kept.value[3] = late, before


@part()
def _follow_jumps(jumped: bool, kept: DecisionState) -> None:
    """Handle a jump: another fault while armed, otherwise settling starts again."""
    count = kept.counts
    count[JUMP_AGO] = min(count[JUMP_AGO] + 1, WAKE)
    if not jumped:
        return
    if count[WAS_JUDGING] == 0:
        count[CHANGED] = 0
        return
    count[JUMP_AGO], count[DEPARTURE_AGO] = 0, 0
    count[ONSET] = max(count[ONSET], 0)
    kept.value[0] = OTHER


@part()
def _remember(kept: DecisionState, row: FloatArray, speed: float, levels: FloatArray) -> None:
    """Store a sample; the first columns are in the order of the residual's."""
    head = kept.counts[HEAD]
    for c in range(DELAYED):
        kept.rows[head, c] = row[c]
    late = kept.lateness[TAU] * row[LATE_UNIT]
    kept.rows[head, ERROR] = row[ERROR] - late
    kept.rows[head, DELAYED] = row[LATE_UNIT]
    kept.rows[head, READ] = still_unsure(row[UNSURE_INPUT], kept.instants)
    kept.rows[head, SPEED], kept.rows[head, BARE] = speed, row[DRY_BARE]
    kept.rows[head, UNDECIDED] = undecided(row[MOVED], kept.edges)
    for c in range(levels.size):
        kept.rows[head, LEVELS + c] = levels[c]
    kept.counts[HEAD] = (head + 1) % HISTORY
    kept.counts[FILLED] = min(kept.counts[FILLED] + 1, HISTORY)


@part()
def _judge(  # noqa: PLR0917 -- a kernel
    k: int,
    inside: bool,
    usual: FloatArray,
    response: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Fill the outputs of sample `k`, which is stored, and carry on the mode and the episode."""
    count = kept.counts
    count[SINCE_START] += 1
    count[OUTSIDE] = 0 if not inside else min(count[OUTSIDE] + 1, LONG)
    count[WHOLE_AGO] = 0
    spread, limit, known, onset = deviate(k, usual, response, rules, kept, out)
    away = departs(out[DEVIATION, k], known, onset, kept)
    mode = _mode(kept, rules)
    out[MODE, k] = mode
    count[WAS_JUDGING] = 1 if mode == JUDGING else 0
    if mode != BEYOND and kept.sums[SEEN] > 0.0:
        fill(kept.sums, 0.0)
    if mode == JUDGING:
        follow_episode(k, away, spread, rules, kept, out)
    else:
        count[ONSET] = -1
        kept.value[0] = UNNAMED
        if mode == BEYOND:
            name_unrecorded(k, spread, limit, rules, kept, out)
    for c in range(kept.judged.size):
        kept.judged[c] = out[c, k]


@part()
def _hold(k: int, kept: DecisionState, out: FloatArray) -> None:
    """Repeat the outputs of the last sample with a whole kernel: nothing else is known by now.

    What was found once is not counted again; after many such samples the rig is not watched.
    """
    kept.counts[SINCE_START] += 1
    kept.counts[WHOLE_AGO] += 1
    for c in range(kept.judged.size):
        out[c, k] = kept.judged[c]
    if kept.counts[WHOLE_AGO] > LONG:
        out[MODE, k] = ARMING


@part()
def _mode(kept: DecisionState, rules: DecisionRules) -> float:
    """The mode: armed once everything has settled and is quiet, or after a maximum time."""
    count = kept.counts
    if count[SINCE_START] < rules.settle:
        count[OUTSIDE] = min(count[SINCE_START], LONG)
        return ARMING
    if count[JUMP_AGO] < WAKE:
        return JUDGING
    if count[OUTSIDE] < LONG and count[OUTSIDE] < count[SINCE_START]:
        return BEYOND
    if count[CHANGED] < rules.settle and count[ONSET] < 0:
        return ARMING
    if count[QUIET] >= MEDIUM or count[SINCE_START] >= 2 * rules.settle:
        return JUDGING
    return ARMING
