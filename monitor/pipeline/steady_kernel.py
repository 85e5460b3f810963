"""One call for the blocks of many rigs that follow their last ones and have only good readings.

    states, blocks ─▶ admission ─▶ clipping ─▶ residual ─▶ watch ─▶ outputs, and whether any
    condition holds

These are the kernels of the stages themselves, one rig after the other, so the numbers are those of
`Monitor.update` to the last bit. What costs less is the way to them: a call, with its states, for
each stage and rig takes longer than the work on some samples.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.clipping import SteadyClipping, judge_flat_tops
from monitor.decision import kernel_state as w
from monitor.decision import watch_block
from monitor.pipeline.flags import JUDGED, Flagging, flag
from monitor.reference import Reference, ReferenceRules
from monitor.signals import Filters, SteadyAdmission, admit_steady, advance_filters
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.kept_state import kept
from rigwatch.wire.kernel import kernel, part

CONDITIONS = len(JUDGED)
COLUMNS = 7
"""Columns of the residual stage."""


class SteadyState(NamedTuple):
    """All that the stages of one rig carry from block to block, and their rules."""

    admission: SteadyAdmission
    clipping: SteadyClipping
    filters: Filters
    rules: w.Rules
    arming: ReferenceRules
    reference: Reference
    watch: w.WatchState
    flagging: Flagging


class Outputs(NamedTuple):
    """Results of r rigs with n samples each, and m channels of the model.

    Attributes:
        columns: of `watch_block`, shape (r, OUTPUTS, n).
        reset: where filters were reset, shape (r, n).
        clipping: score of each channel, shape (r, n, m).
        judged: whether the rig has been judged, shape (r,); if not, its state is as before.
        holds: whether any condition holds at any sample, shape (r,).
    """

    columns: FloatArray
    reset: BoolArray
    clipping: FloatArray
    judged: BoolArray
    holds: BoolArray


def new_outputs(rigs: int, samples: int, channels: int) -> Outputs:
    """Outputs to be filled."""
    return Outputs(
        np.zeros((rigs, w.OUTPUTS, samples)),
        np.zeros((rigs, samples), np.bool_),
        np.zeros((rigs, samples, channels)),
        np.zeros(rigs, np.bool_),
        np.zeros(rigs, np.bool_),
    )


@kernel()
def judge_steady(  # noqa: PLR0917
    like: Any,
    addresses: IntArray,
    values: FloatArray,
    flags: NDArray[np.uint8],
    places: IntArray,
    device_us: IntArray,
    first: IntArray,
    out: Outputs,
) -> None:
    """Judge a block of each rig.

    Args:
        like: the `SteadyState` of any of them.
        addresses: of their states (`KeptState`), shape (r,).
        values: a row for each channel of the block, shape (r, any, n).
        flags: of quality, shape (r, any).
        places: the rows of the model's channels, shape (r, m).
        device_us: shape (r, n).
        first: numbers of the first samples, shape (r,).
        out: filled.
    """
    for r in range(addresses.size):
        if flags[r].any():
            continue
        out.judged[r] = _judge(
            kept(like, addresses[r]),
            values[r],
            places[r],
            device_us[r],
            first[r],
            out.columns[r],
            out.reset[r],
            out.clipping[r],
            out.holds[r : r + 1],
        )


@part(allocates=True)
def _judge(  # noqa: PLR0917
    state: SteadyState,
    values: FloatArray,
    places: IntArray,
    device_us: IntArray,
    first: int,
    columns: FloatArray,
    reset: BoolArray,
    clipping: FloatArray,
    holds: BoolArray,
) -> bool:
    n, channels = device_us.size, places.size
    signals, good = np.empty((n, channels)), np.empty((n, channels), np.bool_)
    code, run = np.empty(n, np.int64), np.empty(n, np.int64)
    if not admit_steady(state.admission, values, places, device_us, signals, good, code, run):
        return False
    clip = state.clipping
    if clip.judged > 0:
        judge_flat_tops(signals, good, clip.chance, clip.limit, clip.state, clipping)
        holds[0] = (clipping > clip.limit).any()
    data = np.zeros((n, COLUMNS))
    advance_filters(signals, code, np.zeros((0, 3)), state.filters, data, reset)
    valid = np.ones(n, np.uint8)
    watch_block(
        data, code, valid, first, state.rules, state.arming, state.reference, state.watch, columns
    )
    flags: NDArray[np.uint8] = np.empty((CONDITIONS, n), np.uint8)
    flag(columns, run, 0, state.flagging, flags)
    holds[0] |= flags.any() or reset.any()
    return True
