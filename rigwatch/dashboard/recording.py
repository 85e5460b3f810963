"""Draws a whole recording on the same screen as a live rig, with the cursor at the fault.

The cursor is at the first alarm that indicates a fault, or at the end if there is none.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeGuard

import rerun as rr
from rerun.experimental import ViewerClient

from rigwatch.dashboard.board import NAMED_FAULTS, Dashboard, Facts, Windows, is_active
from rigwatch.dashboard.board import entities as at
from rigwatch.dashboard.viewer import (
    RECORDING_MEMORY,
    Viewer,
    await_data,
    await_drawing,
    save_picture,
)
from rigwatch.wire.messages import Alarm, Message

_FLUSH_AFTER = 16384
_LONGEST_WHOLE = 300.0
_SIGNALS = 5.0
_HISTORY = 60.0
_FLUSH_TIMEOUT = 60.0


@dataclass(frozen=True, slots=True)
class Drawn:
    """The drawn part of a recording.

    Attributes:
        samples: number of samples.
        start_ns, end_ns: first and last time [ns]; 0 if nothing was drawn.
        fault_ns: time of the first alarm raised here that names a fault, else of the first fault
            [ns]; 0 if there was none.
    """

    samples: int
    start_ns: int
    end_ns: int
    fault_ns: int

    def cursor_ns(self) -> int:
        """Position of the cursor: the fault in the middle of the signals' window."""
        if not self.fault_ns:
            return self.end_ns
        return min(self.end_ns, self.fault_ns + round(0.5e9 * _SIGNALS))


def windows_for(seconds: float) -> Windows:
    """Time span of the plots for a recording of that length [s]."""
    return Windows(_SIGNALS, None if seconds <= _LONGEST_WHOLE else _HISTORY)


def draw(
    messages: Iterable[Message],
    stream: rr.RecordingStream,
    facts: Facts,
    windows: Windows,
    progress: Callable[[int], None],
    *,
    bare: bool = False,
) -> Drawn:
    """Draw the messages of a recording, in recorded order.

    Args:
        messages: of any topic.
        stream: connected to a viewer or a file.
        facts: the rig, its model and marks.
        windows: time span of the plots.
        progress: called with the number of samples drawn.
        bare: hide the controls of the viewer, for pictures.
    """
    dashboard = Dashboard(stream, facts, windows, bare=bare)
    flushed = 0
    faults: dict[str, int] = {}
    for message in messages:
        dashboard.show(message)
        # What stands before the first sample was raised before this part.
        if facts.samples and _is_fault(message):
            faults.setdefault(message.name, message.t_ns)
        if facts.samples - flushed >= _FLUSH_AFTER:
            flushed = facts.samples
            dashboard.flush()
            progress(flushed)
    dashboard.finish()
    stream.flush(timeout_sec=_FLUSH_TIMEOUT)
    stream.disconnect()
    return Drawn(facts.samples, dashboard.began_ns, dashboard.now_ns, _most_telling(faults))


def _is_fault(message: Message) -> TypeGuard[Alarm]:
    return isinstance(message, Alarm) and is_active(message) and message.severity != "info"


def _most_telling(faults: dict[str, int]) -> int:
    """The time of the first named fault, else of any fault; 0 if there is none."""
    named = [t_ns for name, t_ns in faults.items() if name in NAMED_FAULTS]
    return min(named or faults.values(), default=0)


def point_cursor(url: str, t_ns: int) -> None:
    """Pause the viewer at `url` at a time [ns], once it has received data up to it.

    Raises:
        ViewerError: it does not receive them in time.
    """
    client = ViewerClient.connect(url)
    await_data(client, at.TIMELINE, t_ns)
    client.set_time(at.TIMELINE, timestamp=t_ns / 1e9, play_state="paused")


def take_picture(viewer: Viewer, path: Path) -> None:
    """Write what a headless viewer shows as a PNG file."""
    save_picture(ViewerClient.connect(viewer.url), path)


def headless_viewer() -> Viewer:
    """A viewer that draws into memory; needs a graphics driver, such as Mesa's software one.

    Raises:
        ViewerError: it does not start, or draws nothing.
    """
    return await_drawing(Viewer("headless", memory=RECORDING_MEMORY).await_answer())
