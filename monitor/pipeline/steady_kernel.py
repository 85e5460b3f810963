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


class RowOutputs(NamedTuple):
    """Results of blocks of any lengths, one after the other, of rigs with up to m channels.

    Attributes:
        columns: of `watch_block`, OUTPUTS values for each sample, shape (OUTPUTS, n) of a block.
        reset: where filters were reset, shape (samples,).
        clipping: m values for each sample, of which (n, channels) of a block are used.
        judged, holds: as in `Outputs`.
    """

    columns: FloatArray
    reset: BoolArray
    clipping: FloatArray
    judged: BoolArray
    holds: BoolArray

    def of(self, place: int, at: int, samples: int, channels: int) -> Outputs:
        """Those of one block, which has so many samples before it."""
        columns = self.columns[w.OUTPUTS * at : w.OUTPUTS * (at + samples)]
        widest = self.clipping.size // max(1, self.reset.size)
        clipping = self.clipping[widest * at :][: samples * channels]
        return Outputs(
            columns.reshape(1, w.OUTPUTS, samples),
            self.reset[at : at + samples].reshape(1, samples),
            clipping.reshape(1, samples, channels),
            self.judged[place : place + 1],
            self.holds[place : place + 1],
        )


def new_row_outputs(blocks: int, samples: int, channels: int) -> RowOutputs:
    """Outputs to be filled, of so many blocks and samples."""
    return RowOutputs(
        np.zeros(w.OUTPUTS * samples),
        np.zeros(samples, np.bool_),
        np.zeros(samples * channels),
        np.zeros(blocks, np.bool_),
        np.zeros(blocks, np.bool_),
    )


@kernel()
def judge_rows(  # noqa: PLR0917
    like: Any,
    addresses: IntArray,
    places: IntArray,
    channels: IntArray,
    columns: IntArray,
    rows: IntArray,
    samples: IntArray,
    first: IntArray,
    at: IntArray,
    values_at: IntArray,
    wanted: BoolArray,
    values: FloatArray,
    device_us: IntArray,
    out: RowOutputs,
) -> None:
    """Judge blocks of any lengths as `judge_steady` does, each of another row.

    Args:
        like: the `SteadyState` of any row.
        addresses: of the rows' states, shape (rows,).
        places: where the model's channels are among a block's, shape (rows, any).
        channels, columns: number of the model's channels, and of a block's, shape (rows,).
        rows: of the blocks, shape (k,).
        samples, first: of each block, shape (k,).
        at, values_at: samples and values before each block, shape (k,).
        wanted: whether a block is to be judged, shape (k,); none has a flag.
        values: of all blocks, each of shape (columns, n).
        device_us: of all blocks.
        out: filled.
    """
    widest = places.shape[1]
    for k in range(rows.size):
        if not wanted[k]:
            continue
        row, n = rows[k], samples[k]
        begin, end, m, c = at[k], at[k] + n, channels[row], columns[row]
        out.judged[k] = _judge(
            kept(like, addresses[row]),
            values[values_at[k] : values_at[k] + c * n].reshape((c, n)),
            places[row, :m],
            device_us[begin:end],
            first[k],
            out.columns[w.OUTPUTS * begin : w.OUTPUTS * end].reshape((w.OUTPUTS, n)),
            out.reset[begin:end],
            out.clipping[widest * begin : widest * begin + n * m].reshape((n, m)),
            out.holds[k : k + 1],
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
