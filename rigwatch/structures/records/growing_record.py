"""A record that grows with the samples of a device: the structure's signals and its loads.

Rows count from the first sample on. What was lost or is invalid is NaN. A load is bridged there, as
in a record of a file, and the signals beside it are missing too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigwatch.structures.records.record import LONGEST, Record, bridged
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
        self._measured = np.zeros((ROOM, len(loads)))
        self._observed = np.zeros((ROOM, len(signals)))
        self._t_ns = np.zeros(ROOM, np.int64)
        self._last = [-1] * len(loads)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def inputs(self) -> FloatArray:
        """Loads, shape (samples, loads); bridged where one is missing."""
        return self._inputs[: self._count]

    @property
    def observed(self) -> FloatArray:
        """Signals, shape (samples, signals); NaN where they or a load are missing."""
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
        self._measured[begin:middle] = np.nan
        self._observed[begin:middle] = np.nan
        for k, values in enumerate(loads):
            self._measured[middle : self._count, k] = values
        for k, values in enumerate(signals):
            self._observed[middle : self._count, k] = values
        self._t_ns[begin:middle] = block.t_ns[0]
        self._t_ns[middle : self._count] = block.t_ns
        measured = self._measured[begin : self._count]
        self._observed[begin : self._count][~np.isfinite(measured).all(axis=1)] = np.nan
        for k in range(len(self._loads)):
            self._bridge(k, begin)

    @property
    def settled(self) -> int:
        """Rows whose loads no later sample changes: a short gap at the end waits for what follows.

        They do not depend on how the samples are cut into blocks.
        """
        ends = [self._count - 1 - last for last in self._last]
        return self._count - max((gap for gap in ends if gap <= LONGEST), default=0)

    def _bridge(self, k: int, begin: int) -> None:
        """Fill the gaps of a load, from the last one that may still have been open on."""
        first = max(self._last[k], begin - 2 * LONGEST, 0)
        part = self._measured[first : self._count, k].copy()
        if first != self._last[k] and first:
            part[0] = self._inputs[first, k]
        self._inputs[first : self._count, k] = bridged(part)
        (known,) = np.nonzero(np.isfinite(self._measured[begin : self._count, k]))
        if len(known):
            self._last[k] = begin + int(known[-1])

    def record(self, rows: int) -> Record:
        """The first rows of it."""
        columns = dict(zip(self._loads, self._measured[:rows].T, strict=True))
        columns |= dict(zip(self._signals, self._observed[:rows].T, strict=True))
        return Record(self.dt, {name: column.copy() for name, column in columns.items()})

    def _make_room(self) -> None:
        while self._count > len(self._t_ns):
            self._inputs = np.concatenate([self._inputs, np.zeros_like(self._inputs)])
            self._measured = np.concatenate([self._measured, np.zeros_like(self._measured)])
            self._observed = np.concatenate([self._observed, np.zeros_like(self._observed)])
            self._t_ns = np.concatenate([self._t_ns, np.zeros_like(self._t_ns)])
