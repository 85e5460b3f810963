"""Pictures of what a headless viewer shows."""

import io
import time
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

_EMPTY_TOP = 36
"""Where the viewer's own bar would be [pixels]."""
_FRAMES, _FRAME = 48, 0.125
"""Frames, and time for each [s], with which the viewer's own notices go from the screen."""


def save_picture(client: ViewerClient, path: Path) -> None:
    """Write what the viewer shows, without its own notices, as a PNG file."""
    for _ in range(_FRAMES):
        began = time.monotonic()
        shown = client.take_screenshot()
        time.sleep(max(0.0, began + _FRAME - time.monotonic()))
    picture = Image.open(io.BytesIO(shown)).convert("RGB")
    picture = picture.crop((0, _EMPTY_TOP, *picture.size))
    # The viewer packs its pictures for speed; packed well they are a third smaller.
    picture.save(path, format="PNG", optimize=True)
