"""A record that grows with the samples of a device: the structure's signals and its loads.

Rows count from the first sample on. What was lost or is invalid is NaN in a signal; a load is held
there, since the model cannot run without it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigwatch.structures.records.record import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import SampleBlock

ROOM = 4096


class GrowingRecord:
    """Columns of one device since its first sample.

    Args:
        dt: time between samples [s].
        signals: channels that are compared with the model.
        loads: channels that drive it.
    """

    def __init__(self, dt: float, signals: Sequence[str], loads: Sequence[str]) -> None:
        self.dt = dt
        self._signals, self._loads = tuple(signals), tuple(loads)
        self._inputs = np.zeros((ROOM, len(loads)))
        self._observed = np.zeros((ROOM, len(signals)))
        self._t_ns = np.zeros(ROOM, np.int64)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def inputs(self) -> FloatArray:
        """Loads, shape (samples, loads)."""
        return self._inputs[: self._count]

    @property
    def observed(self) -> FloatArray:
        """Signals, shape (samples, signals); NaN for invalid samples."""
        return self._observed[: self._count]

    @property
    def t_ns(self) -> NDArray[np.int64]:
        """Time of the samples, of lost ones that of the next [ns], shape (samples,)."""
        return self._t_ns[: self._count]

    def take(self, block: SampleBlock, lost: int = 0) -> None:
        """Append a block after a number of lost samples; KeyError if it lacks a channel."""
        loads = [block.channel(name).usable() for name in self._loads]
        signals = [block.channel(name).usable() for name in self._signals]
        begin, middle = self._count, self._count + lost
        self._count = middle + len(block)
        self._make_room()
        self._inputs[begin:middle] = np.nan
        self._observed[begin:middle] = np.nan
        for k, values in enumerate(loads):
            self._inputs[middle : self._count, k] = values
        for k, values in enumerate(signals):
            self._observed[middle : self._count, k] = values
        self._t_ns[begin:middle] = block.t_ns[0]
        self._t_ns[middle : self._count] = block.t_ns
        for row in range(begin, self._count):
            held = self._inputs[row - 1] if row else np.zeros(len(self._loads))
            self._inputs[row] = np.where(np.isnan(self._inputs[row]), held, self._inputs[row])

    def record(self, rows: int) -> Record:
        """The first rows of it."""
        columns = dict(zip(self._loads, self._inputs[:rows].T, strict=True))
        columns |= dict(zip(self._signals, self._observed[:rows].T, strict=True))
        return Record(self.dt, {name: column.copy() for name, column in columns.items()})

    def _make_room(self) -> None:
        while self._count > len(self._t_ns):
            self._inputs = np.concatenate([self._inputs, np.zeros_like(self._inputs)])
            self._observed = np.concatenate([self._observed, np.zeros_like(self._observed)])
            self._t_ns = np.concatenate([self._t_ns, np.zeros_like(self._t_ns)])
