"""The recorder process: writes the recorded topics of the bus to session files.

`expired` holds its rules of retention, which archives use too; `POSITIONS` is the name of the file
that it keeps beside segments; `last_block` the end of a session, from its last segments;
`sessions_of` the sessions of a rig where others may record too, and `newest` the last of them.
"""

from rigwatch.recorder.folders import last_block, newest, sessions_of
from rigwatch.recorder.positions import FILE as POSITIONS
from rigwatch.recorder.process import run
from rigwatch.recorder.retention_rules import expired
from rigwatch.recorder.several import run_several

__all__ = ["POSITIONS", "expired", "last_block", "newest", "run", "run_several", "sessions_of"]
