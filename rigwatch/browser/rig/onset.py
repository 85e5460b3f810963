"""Finds the onset of an alarm in a rig's recordings, by the number of its sample.

An alarm's time is that of its latest transition: an operator who acknowledges it moves the time,
not the onset.
"""

from dataclasses import dataclass
from pathlib import Path

from rigwatch.recorder import sessions_of
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm
from rigwatch.wire.session import SUFFIX, Session, open_session

CLEARED = "cleared_unacknowledged"
CLEARS = 1.5
"""Time after the end of a fault at which its alarm clears [s]."""


@dataclass(frozen=True)
class Onset:
    """An alarm's onset in a recording.

    Attributes:
        session: the segments around it.
        t_ns: time of the first sample at which the condition held [ns].
    """

    session: Session
    t_ns: int

    def recorded(self, before: float, after: float) -> tuple[float, float]:
        """How much of the time `before` and `after` the onset was recorded [s]."""
        start, end = (self.t_ns + round(seconds * 1e9) for seconds in (-before, after))
        blocks = list(self.session.samples(start=start, end=end))
        first, last = int(blocks[0].t_ns[0]), int(blocks[-1].t_ns[-1])
        return (self.t_ns - first) / 1e9, (last - self.t_ns) / 1e9

    def lasted(self, name: str) -> float | None:
        """Length of the fault [s]; None if its alarm has not cleared in these segments."""
        for item in self.session.messages(["alarms"], start=self.t_ns):
            found = item.message
            if isinstance(found, Alarm) and found.name == name and found.state == CLEARED:
                return (found.t_ns - self.t_ns) / 1e9 - CLEARS
        return None


def onset_of(folder: Path, rig: str, alarm: Alarm) -> Onset:
    """The onset of an alarm, looked for from the rig's newest recording back.

    Args:
        folder: of the recorder; other rigs may record there too.
        rig: id of the rig.
        alarm: with a sample.

    Raises:
        SessionError: the sample was not recorded.
    """
    number = alarm.onset_seq if alarm.onset_seq >= 0 else alarm.seq
    for path in _newest_first(folder, rig):
        t_ns = _time_of(path, alarm.device, alarm.boot, number)
        if t_ns is not None:
            return Onset(_around(path), t_ns)
    raise SessionError(
        f"{folder}: found no recording of sample {number} of {alarm.device}, at which"
        f" {alarm.name} began; expected that the recorder ran then"
    )


def _newest_first(folder: Path, rig: str) -> list[Path]:
    segments = (path for own in sessions_of(folder, rig) for path in own.glob(f"*{SUFFIX}"))
    return sorted(segments, key=lambda path: -path.stat().st_mtime)


def _time_of(path: Path, device: str, boot: int, number: int) -> int | None:
    """Time of a sample in a segment [ns]."""
    try:
        blocks = open_session(path).samples(device)
        for block in blocks:
            if block.boot == boot and block.seq <= number < block.seq + len(block):
                return int(block.t_ns[number - block.seq])
    except SessionError:  # a segment of which nothing has reached the disk yet
        return None
    return None


def _around(path: Path) -> Session:
    """A segment with its neighbours in its session."""
    whole = open_session(path.parent).segments
    at = whole.index(path)
    return Session(path.parent, whole[max(at - 1, 0) : at + 2])
