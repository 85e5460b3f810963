"""Looking at a headless viewer: what it shows, by name and by colour."""

import contextlib
import io
import time
from dataclasses import dataclass

import numpy as np
from PIL import Image
from rerun.experimental import ViewerClient

from rigwatch.dashboard.board.palette import Colour


@dataclass(frozen=True)
class Patch:
    """Pixels of one colour in a view."""

    pixels: int
    spread: float  # width over which they lie, as a share of the view's


class Screen:
    """What a viewer shows."""

    def __init__(self, url: str) -> None:
        self.client = ViewerClient.connect(url)

    def timeline_end(self, name: str = "time") -> int:
        """The last time of the active recording on a timeline, 0 where there is none."""
        state = self.client.get_state()
        for recording in state.recordings:
            for timeline in recording.timelines:
                if recording.store_id == state.active_recording and timeline.name == name:
                    return timeline.end or 0
        return 0

    def views(self) -> dict[str, str]:
        """View ids by title."""
        return {view.name: view.view_id for view in self.client.get_state().views}

    def reports(self) -> list[str]:
        """What the views complain of."""
        views = self.client.get_state().views
        return [f"{view.name}: {report.summary}" for view in views for report in view.reports]

    def errors(self) -> list[str]:
        """Errors in the viewer's log."""
        return [entry.message for entry in self.client.get_logs() if entry.level == "ERROR"]

    def picture(self, title: str) -> np.ndarray:
        """One view as it is drawn, shape (height, width, 3)."""
        png = self._shot(title)
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)

    def _shot(self, title: str) -> bytes:
        # A new layout gives every view a new id, which may come between the two calls.
        for _ in range(20):
            with contextlib.suppress(ConnectionError, KeyError):
                return bytes(self.client.take_screenshot(self.views()[title]))
            time.sleep(0.2)
        raise AssertionError(f"no view {title!r} among {sorted(self.views())}")

    def lane(self, title: str, colour: Colour) -> Patch:
        """A state's pixels: the viewer draws lanes at 78 % of the colour's brightness."""
        red, green, blue = (round(0.78 * part) for part in colour)
        return self.patch(title, (red, green, blue), 15)

    def patch(self, title: str, colour: Colour, tolerance: int = 40) -> Patch:
        """Pixels near a colour in the view with that title."""
        picture = self.picture(title)
        near = np.abs(picture - np.array(colour)).max(axis=2) < tolerance
        columns = np.nonzero(near.any(axis=0))[0]
        spread = np.ptp(columns) / picture.shape[1] if len(columns) else 0.0
        return Patch(int(near.sum()), float(spread))
