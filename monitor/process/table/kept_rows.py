"""What a ranking of causes needs of the newest samples of each row, until its rig gets it.

A block for each row is put down by one call; a rig's `Explainer` gets some hundred samples at once.
"""

from typing import NamedTuple

import numpy as np

from monitor.diagnosis import JOINED
from monitor.pipeline import CHANGE_ROW, OUTPUT_ROWS, SampleRows
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import (
    Column,
    EstimateBlock,
    Names,
    SampleBlock,
)
from rigwatch.wire.rows import MOST_COLUMNS, MOST_SAMPLES

ROOM = JOINED + MOST_SAMPLES
_CHANGE = "change", "m/s^2"


class _Kept(NamedTuple):
    """Samples of each row: numbers of them, times, values and change.

    Attributes:
        number: of the samples that are kept, shape (rows,).
        limit: from how many on they are given to the rig, shape (rows,).
        times: of device and host, shape (rows, 2, ROOM).
        values: of the channels, and last the change, shape (rows, channels + 1, ROOM).
    """

    number: IntArray
    limit: IntArray
    times: IntArray
    values: FloatArray


class KeptRows:
    """The newest samples of the rows.

    Args:
        count: rows.
    """

    def __init__(self, count: int) -> None:
        self._kept = _Kept(
            np.zeros(count, np.int64),
            np.full(count, JOINED, np.int64),
            np.zeros((count, 2, ROOM), np.int64),
            np.zeros((count, MOST_COLUMNS + 1, ROOM)),
        )
        self._columns = np.zeros(count, np.int64)

    def enter(self, row: int, columns: int, loose: int) -> None:
        """Keep a row's samples of so many channels; its rig has kept `loose` ones itself."""
        self._columns[row], self._kept.number[row] = columns, 0
        self._kept.limit[row] = max(1, JOINED - loose)

    def keep(
        self, blocks: SampleRows, t_ns: IntArray, columns: FloatArray, wanted: BoolArray
    ) -> list[int]:
        """Put down those blocks that are wanted; the rows that are full.

        Args:
            blocks: each of another row.
            t_ns: of all samples.
            columns: outputs of the kernel, for all samples.
            wanted: shape (k,).
        """
        full = np.zeros(len(blocks.rows), np.bool_)
        _keep(blocks, t_ns, columns, wanted, self._columns, self._kept, full)
        return blocks.rows[full].tolist() if full.any() else []

    def taken(
        self, row: int, source: tuple[str, int, int], names: Names
    ) -> tuple[EstimateBlock, SampleBlock] | None:
        """Change and samples of a row, which are forgotten; None if there are none.

        Args:
            row: of the rig.
            source: device, boot, and the number of the sample after the last one.
            names: of the channels.
        """
        n, c = int(self._kept.number[row]), len(names)
        if not n:
            return None
        self._kept.number[row], self._kept.limit[row] = 0, JOINED
        device, boot, end = source
        device_us, t_ns = self._kept.times[row, :, :n].copy()
        values = self._kept.values[row, : c + 1, :n].copy()
        columns = tuple(
            [
                Column(name, unit, one, np.zeros(n if judged else 0, np.uint8))
                for (name, unit, judged), one in zip(names, values[:c], strict=True)
            ]
        )
        change = Column(*_CHANGE, values[c], np.zeros(0, np.uint8))
        return (
            EstimateBlock(device, boot, end - n, t_ns, (change,)),
            SampleBlock(device, boot, end - n, device_us, t_ns, columns),
        )


@kernel()
def _keep(  # noqa: PLR0917
    blocks: SampleRows,
    t_ns: IntArray,
    columns: FloatArray,
    wanted: BoolArray,
    channels: IntArray,
    kept: _Kept,
    full: BoolArray,
) -> None:
    for k in range(blocks.rows.size):
        if not wanted[k]:
            continue
        row, n, begin = blocks.rows[k], blocks.samples[k], blocks.at[k]
        at, change = kept.number[row], OUTPUT_ROWS * begin + CHANGE_ROW * n
        for i in range(n):
            kept.times[row, 0, at + i] = blocks.device_us[begin + i]
            kept.times[row, 1, at + i] = t_ns[begin + i]
            for c in range(channels[row]):
                kept.values[row, c, at + i] = blocks.values[blocks.values_at[k] + c * n + i]
            kept.values[row, channels[row], at + i] = columns[change + i]
        kept.number[row] = at + n
        full[k] = at + n >= kept.limit[row]
