"""Session files: what a rig said, kept as MCAP with protobuf messages.

`SessionWriter` writes one file, `open_session` reads a file or a folder of segments, damaged or
not.
"""

from rigwatch.wire.session.reader import LostSpan, Recorded, Session, open_session
from rigwatch.wire.session.writer import SessionWriter, run_info

__all__ = ["LostSpan", "Recorded", "Session", "SessionWriter", "open_session", "run_info"]
