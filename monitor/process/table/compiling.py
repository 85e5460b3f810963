"""Compiles what a table calls, before a sample waits for it."""

import numpy as np

from monitor.model import RigModel
from monitor.pipeline import (
    PUBLISHED_NAMES,
    ColumnBytes,
    RigMonitor,
    SampleRows,
    SteadyRows,
)
from monitor.process.table.kept_rows import KeptRows
from rigwatch.wire.bus import Source, join
from rigwatch.wire.messages import (
    Column,
    SampleBlock,
    encode,
)
from rigwatch.wire.rows import MOST_COLUMNS, MOST_SAMPLES, Blocks, EstimateRows, JointRows

_RIG, _BOOT, _SAMPLES = "rig", 1, 4


def compile_table(model: RigModel, known: set[str] | None = None) -> None:
    """Judge a block of a separate monitor in a row, if its model has a state for one.

    Args:
        model: of the rig.
        known: kinds of states for which that has been done; one more is added.
    """
    rig, n, known = RigMonitor(model), _SAMPLES, set() if known is None else known
    rig.update(_block(model, 0))
    if (state := rig.steady()) is None or state.kind in known:
        return
    known.add(state.kind)
    reading, steady = JointRows(1), SteadyRows(1, MOST_COLUMNS)
    estimates = EstimateRows(1, PUBLISHED_NAMES, MOST_SAMPLES)
    reading.name(0, _RIG)
    reading.open(_RIG, Source(_RIG, _RIG, _BOOT, lambda _: True), n)
    reading.take(join([(_RIG, b"", encode(_block(model, n)))]), _RIG)
    (batch,) = reading.taken()
    steady.enter(0, state, [*range(len(model.channels))], len(model.channels))
    blocks = SampleRows(*batch[:5], batch.device_us, batch.values)
    out = steady.judged(blocks, np.ones(1, np.bool_))
    estimates.begin(0, _RIG, (_RIG, _BOOT), (1, 0))
    columns, times = ColumnBytes(out, batch.at), batch.t_ns.view(np.uint8)
    estimates.written(Blocks(*batch[:4], times, columns.data, columns.starts))
    KeptRows(1).keep(blocks, batch.t_ns, out.columns, out.judged)


def _block(model: RigModel, seq: int) -> SampleBlock:
    zeros = np.zeros(_SAMPLES)
    flags = np.zeros(_SAMPLES, np.uint8)
    channels = tuple(Column(name, "", zeros, flags) for name in model.channels)
    times = np.arange(seq, seq + _SAMPLES, dtype=np.int64)
    return SampleBlock(_RIG, _BOOT, seq, times, times, channels)
