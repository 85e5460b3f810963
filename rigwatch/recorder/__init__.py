"""The recorder process: writes the recorded topics of the bus to session files.

    bus ──▶ Feed (complete and in order) ──▶ Store (segments; waits for the disk) ──▶ session folder

`folders` chooses the folder and finds the sessions of a rig; `positions` stores how far a recording
has come, for a recorder that is restarted; `retention` removes and thins old recordings, by rules
that archives have too. `past` closes the gap that a cut link to a remote rig leaves.
"""

from rigwatch.recorder.folders import last_block, newest
from rigwatch.recorder.positions import FILES as POSITIONS
from rigwatch.recorder.positions import load_positions
from rigwatch.recorder.process import run
from rigwatch.recorder.retention import expired
from rigwatch.recorder.session_list import sessions_of
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
