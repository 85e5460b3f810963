"""The recorder process: writes the recorded topics of the bus to session files.

`expired` holds its rules of retention, which archives use too; `POSITIONS` are the names of files
that it keeps beside segments and `load_positions` what they hold; `sessions_of` finds a rig's
folders, `last_block` the end of a session, from its last segments.
"""

from rigwatch.recorder.folders import last_block, sessions_of
from rigwatch.recorder.positions import FILES as POSITIONS
from rigwatch.recorder.positions import load_positions
from rigwatch.recorder.process import run
from rigwatch.recorder.retention_rules import expired
from rigwatch.recorder.several import run_several

__all__ = [
    "POSITIONS",
    "expired",
    "last_block",
    "load_positions",
    "run",
    "run_several",
    "sessions_of",
]
