"""Pictures of what a headless viewer shows."""

import io
import time
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

from rigwatch.wire.new_file import new_file

_EMPTY_TOP = 36
"""Height of the viewer's own bar [pixels]."""
_FRAMES, _FRAME = 48, 0.125
"""Number of frames, and time for each [s], after which the viewer's notices disappear."""


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
