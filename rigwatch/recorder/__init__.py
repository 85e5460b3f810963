"""The recorder process: writes the recorded topics of the bus to session files.

`expired` holds its rules of retention, which archives use too; `POSITIONS` are the names of files
that it keeps beside segments; `last_block` the end of a session, from its last segments.
"""

from rigwatch.recorder.folders import last_block
from rigwatch.recorder.positions import FILES as POSITIONS
from rigwatch.recorder.process import run
from rigwatch.recorder.retention_rules import expired
from rigwatch.recorder.several import run_several

__all__ = ["POSITIONS", "expired", "last_block", "run", "run_several"]
