"""Where a recording is drawn to: a viewer, or a file that appears when it is complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr

from rigwatch.dashboard.board import APPLICATION
from rigwatch.wire.new_file import new_file


@contextmanager
def drawn_to(name: str, url: str, file: Path) -> Iterator[rr.RecordingStream]:
    """A recording called `name`, which goes to the viewer at `url`, else into `file` (.rrd).

    Raises:
        SessionError: the file cannot be written.
    """
    stream = rr.RecordingStream(APPLICATION, recording_id=name)
    if url:
        stream.connect_grpc(url)
        yield stream
        return
    with new_file(file, replace=True) as part:
        stream.save(part)
        yield stream
        stream.disconnect()
