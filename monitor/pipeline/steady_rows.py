"""The states of many rigs in a table: blocks of any lengths are judged by one call.

What a row needs is taken from its rig once; the state itself stays with the rig, whose results are
those of `judge_steady` to the last bit.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from monitor.decision import kernel_state as w
from monitor.pipeline.pipeline import PUBLISHED_ROWS
from monitor.pipeline.rig_monitor import Judged, RigMonitor
from monitor.pipeline.steady_kernel import Outputs, RowOutputs, judge_rows, new_row_outputs
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.messages import SampleBlock

CHANGE_ROW, OUTPUT_ROWS = w.CHANGE, w.OUTPUTS
"""Row of the change of the residual among the outputs of a block, and their number."""


class SampleRows(NamedTuple):
    """Blocks of some rows, one after the other, as `rigwatch.wire.bus.Batch` has them.

    Attributes:
        rows, samples, first: of each block, shape (k,).
        at, values_at: samples and values before each block, shape (k,).
        device_us: of all samples.
        values: of all blocks, each of shape (columns, n).
    """

    rows: IntArray
    samples: IntArray
    first: IntArray
    at: IntArray
    values_at: IntArray
    device_us: IntArray
    values: FloatArray


class SteadyRows:
    """The states of the rigs of a table.

    Args:
        count: rows.
        widest: channels of a model at most.
    """

    def __init__(self, count: int, widest: int) -> None:
        self._like: KeptState | None = None
        self._states: list[KeptState | None] = [None] * count
        self._addresses = np.zeros(count, np.int64)
        self._places = np.zeros((count, widest), np.int64)
        self._channels = np.zeros(count, np.int64)
        self._columns = np.zeros(count, np.int64)

    def enter(self, row: int, state: KeptState, places: Sequence[int], columns: int) -> bool:
        """Judge a row with a state from now on.

        Args:
            row: of the rig.
            state: from `RigMonitor.at_rest`.
            places: where the model's channels are among those of a block.
            columns: channels of a block.

        Returns:
            False if the state's kind is another than that of the other rows.
        """
        self._like = self._like or state
        if state.kind != self._like.kind or len(places) > self._places.shape[1]:
            return False
        self._states[row], self._addresses[row] = state, state.address
        self._places[row, : len(places)] = places
        self._channels[row], self._columns[row] = len(places), columns
        return True

    def leave(self, row: int) -> None:
        """Forget a row's state."""
        self._states[row] = None

    def judged(self, blocks: SampleRows, wanted: BoolArray) -> RowOutputs:
        """The results of those blocks that are wanted.

        A block that is not judged, as it has a gap or a reading that is not good, has left its rig
        as it was before.
        """
        samples = len(blocks.device_us)
        out = new_row_outputs(len(blocks.rows), samples, self._places.shape[1])
        if self._like is not None:
            judge_rows(
                self._like.state,
                self._addresses,
                self._places,
                self._channels,
                self._columns,
                blocks.rows,
                blocks.samples,
                blocks.first,
                blocks.at,
                blocks.values_at,
                wanted,
                blocks.values,
                blocks.device_us,
                out,
            )
        return out

    def outputs_of(self, blocks: SampleRows, out: RowOutputs, place: int) -> Outputs:
        """Those of one block."""
        channels = int(self._channels[blocks.rows[place]])
        return out.of(place, int(blocks.at[place]), int(blocks.samples[place]), channels)


class ColumnBytes:
    """The published columns of blocks: where they lie among the bytes of the outputs.

    Args:
        out: outputs.
        at: the samples before each block.
    """

    def __init__(self, out: RowOutputs, at: IntArray) -> None:
        self.data = out.columns.view(np.uint8)
        self.starts = out.columns.itemsize * OUTPUT_ROWS * at


def completed(rig: RigMonitor, block: SampleBlock, out: Outputs) -> Judged:
    """The results of a rig of a block that was judged in its row."""
    return rig.completed(block, out.columns[0, PUBLISHED_ROWS], out, 0)
