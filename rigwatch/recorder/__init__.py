"""The recorder process: writes the recorded topics of the bus to session files.

`expired` holds its rules of retention, which archives use too; `POSITIONS` is the name of the file
that it keeps beside segments, of type `Positions`; `sessions_of` finds a rig's folders,
`last_block` the end of a session, from its last segments.
"""

from rigwatch.recorder.folders import last_block, sessions_of
from rigwatch.recorder.positions import FILE as POSITIONS
from rigwatch.recorder.positions import Positions
from rigwatch.recorder.process import run
from rigwatch.recorder.retention_rules import expired
from rigwatch.recorder.several import run_several

__all__ = [
    "POSITIONS",
    "Positions",
    "expired",
    "last_block",
    "run",
    "run_several",
    "sessions_of",
]
