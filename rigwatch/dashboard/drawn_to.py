"""Where a recording is drawn to: a viewer, or a file that appears when it is complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr

from rigwatch.wire.new_file import new_file


@contextmanager
def drawn_to(stream: rr.RecordingStream, url: str, file: Path) -> Iterator[None]:
    """What is logged in the block goes to the viewer at `url`, else into `file` (.rrd).

    Raises:
        SessionError: the file cannot be written.
    """
    if url:
        stream.connect_grpc(url)
        yield
        return
    with new_file(file, replace=True) as part:
        stream.save(part)
        yield
        stream.disconnect()
