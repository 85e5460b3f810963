"""Blocks of many rigs read from and written to joined messages by compiled loops.

    joined message ─▶ part of a rig whose row is open (`named_rows`), and that simply follows its
                      last one ─▶ message by message, to be judged (`joint_rows`), or
                                  all that has come of a rig, to be recorded (`gathered_rows`)
                   └▶ any other part ─▶ the rig's share, and its row is closed
    estimates of all rows ─▶ joined messages (`joint_writing`)

`block_forms` and `estimate_rows` are the blocks themselves. What their bytes share is made by the
one encoding there is (`rigwatch.wire.messages`), so they are the same; what does not fit is left to
it. Only a process of many rigs loads this, as the compiler takes time and memory.
"""

from rigwatch.wire.rows.block_forms import (
    MOST_COLUMNS,
    MOST_SAMPLES,
    OF_ESTIMATES,
    OF_SAMPLES,
    Kind,
)
from rigwatch.wire.rows.gathered_rows import Gathered, GatheredRows, compile_gathering
from rigwatch.wire.rows.joint_rows import Batch, JointRows
from rigwatch.wire.rows.joint_writing import Blocks, EstimateRows

__all__ = [
    "MOST_COLUMNS",
    "MOST_SAMPLES",
    "OF_ESTIMATES",
    "OF_SAMPLES",
    "Batch",
    "Blocks",
    "EstimateRows",
    "Gathered",
    "GatheredRows",
    "JointRows",
    "Kind",
    "compile_gathering",
]
