"""The recorder process: writes the recorded topics of the bus to session files.

`expired` holds its rules of retention, which archives use too; `POSITIONS` are the names of files
that it keeps beside segments and `load_positions` what they hold; `last_block` is the end of a
session, from its last segments; `sessions_of` finds the sessions of a rig where others may record
too, and `newest` the last of them.
"""

from rigwatch.recorder.folders import last_block, newest, sessions_of
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
    "newest",
    "run",
    "run_several",
    "sessions_of",
]
