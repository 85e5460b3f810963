"""What a viewer shows: when it has received its data, and as a picture."""

import contextlib
import io
import time
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

from rigwatch.dashboard.viewer.viewer import Viewer, ViewerError
from rigwatch.wire.new_file import new_file

_EMPTY_TOP = 36
"""Height of the viewer's own bar [pixels]."""
_FRAMES, _FRAME = 48, 0.125
"""Number of frames, and time for each [s], after which the viewer's notices disappear."""


_ARRIVAL_TIMEOUT = 60.0
_NEEDS = (
    "it needs a graphics driver, such as Mesa's for machines without a graphics card"
    " (mesa-vulkan-drivers)"
)


def await_drawing(viewer: Viewer) -> Viewer:
    """Wait until a viewer without a window draws; returns it.

    It answers before it draws, and ends without a word where the graphics driver is missing.

    Raises:
        ViewerError: it ended, or draws nothing in time; it is stopped.
    """
    deadline = time.monotonic() + _ARRIVAL_TIMEOUT
    while viewer.exit_code() is None and time.monotonic() < deadline:
        with contextlib.suppress(ConnectionError):
            ViewerClient.connect(viewer.url).take_screenshot()
            return viewer
        time.sleep(0.1)
    viewer.stop()
    raise ViewerError(f"the viewer draws no picture: {_NEEDS}")


def await_data(client: ViewerClient, timeline: str, end_ns: float) -> None:
    """Wait until a viewer has received the data up to `end_ns` of a timeline.

    Raises:
        ViewerError: it does not receive them in time.
    """
    deadline = time.monotonic() + _ARRIVAL_TIMEOUT
    while _end_of(client, timeline) < end_ns:
        if time.monotonic() > deadline:
            raise ViewerError("the viewer did not take all data in time")
        time.sleep(0.1)


def _end_of(client: ViewerClient, name: str) -> int:
    ends = [
        timeline.end or 0
        for recording in client.get_state().recordings
        for timeline in recording.timelines
        if timeline.name == name
    ]
    return max(ends, default=0)


def save_picture(client: ViewerClient, path: Path) -> None:
    """Write the viewer's screen, without its notices, as a PNG file."""
    for _ in range(_FRAMES):
        began = time.monotonic()
        shown = client.take_screenshot()
        time.sleep(max(0.0, began + _FRAME - time.monotonic()))
    picture = Image.open(io.BytesIO(shown)).convert("RGB")
    picture = picture.crop((0, _EMPTY_TOP, *picture.size))
    # The viewer compresses pictures for speed; better compression saves a third.
    with new_file(path, replace=True) as part:
        picture.save(part, format="PNG", optimize=True)
