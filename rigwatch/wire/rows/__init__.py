"""Blocks of many rigs read from and written to joined messages by compiled loops.

    joined message ─▶ part of a rig whose row is open, and that simply follows its last one ─▶ Batch
                   └▶ any other part ─▶ the rig's share, and its row is closed (`joint_rows`)
    estimates of all rows ─▶ joined messages (`joint_writing`)

`sample_rows` and `estimate_rows` are the blocks themselves. What their bytes share is made by the
one encoding there is (`rigwatch.wire.messages`), so they are the same; what does not fit is left to
it. Only a process that has tables loads this, as the compiler takes time and memory.
"""

from rigwatch.wire.rows.joint_rows import Batch, JointRows
from rigwatch.wire.rows.joint_writing import Blocks, EstimateRows
from rigwatch.wire.rows.sample_rows import MOST_COLUMNS, MOST_SAMPLES

__all__ = ["MOST_COLUMNS", "MOST_SAMPLES", "Batch", "Blocks", "EstimateRows", "JointRows"]
