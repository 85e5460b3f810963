"""Finds the onset of an alarm in a rig's recordings, by the number of its sample.

An alarm's time is that of its latest transition: an operator who acknowledges it moves the time,
not the onset.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigwatch.recorder import sessions_of
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import Alarm
from rigwatch.wire.session import SUFFIX, Session, open_session

CLEARED = "cleared_unacknowledged"
FAULTS = ("departure", "dry_friction", "stiction", "other_fault")
"""Alarms of what the rig does otherwise than its model."""
LOOKED_AT = 12.0
"""Time before and after an onset in which other ends of faults matter [s]."""


@dataclass(frozen=True)
class Ending:
    """How long after a fault has ended this is known.

    Attributes:
        verdict: time after which the monitor's verdict ends [s].
        clears: time after which its alarm clears, unless it was acknowledged and latches [s].
    """

    verdict: float
    clears: float


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

    def lasted(self, name: str, ending: Ending) -> float | None:
        """Length of the fault [s]; None if it has not ended in these segments, as far as they tell.

        An alarm that was acknowledged and latches does not tell that its fault has ended, but the
        monitor's verdict does.

        Args:
            name: of the alarm.
            ending: of its fault.
        """
        cleared = (a for a in self._alarms((name,)) if a.state == CLEARED and a.t_ns >= self.t_ns)
        ends = [(a.t_ns - self.t_ns) / 1e9 - ending.clears for a in cleared]
        if name in FAULTS:
            ends += [after - ending.verdict for after in self._verdict_ends(ending) if after > 0.0]
        return min(ends, default=None)

    def calm(self, ending: Ending) -> float:
        """Time since the end of an earlier fault of the rig [s]; infinite if there was none.

        Args:
            ending: of faults.
        """
        gone = (
            a
            for a in self._alarms(FAULTS)
            if a.t_ns < self.t_ns and (a.state == CLEARED or (a.state == "normal" and not a.user))
        )
        ago = [(self.t_ns - a.t_ns) / 1e9 + ending.clears for a in gone]
        ago += [ending.verdict - after for after in self._verdict_ends(ending) if after <= 0.0]
        return min(ago, default=np.inf)

    def _alarms(self, names: Collection[str]) -> Iterator[Alarm]:
        for item in self.session.messages(["alarms"]):
            if isinstance(item.message, Alarm) and item.message.name in names:
                yield item.message

    def _verdict_ends(self, ending: Ending) -> list[float]:
        """Times after the onset at which a verdict ends, negative before it [s].

        As with the alarm, one that comes back before that would clear has not ended.
        """
        reach = round((LOOKED_AT + ending.clears) * 1e9)
        last, until, found = None, 0.0, list[float]()
        for block in self.session.estimates(start=self.t_ns - reach, end=self.t_ns + reach):
            column = next((one for one in block.columns if one.name == "verdict"), None)
            if column is None:
                continue
            for k in np.flatnonzero(column.values > 0.0).tolist():
                at = (int(block.t_ns[k]) - self.t_ns) / 1e9
                if last is not None and at - last > ending.clears - ending.verdict:
                    found.append(last)
                last = at
            until = (int(block.t_ns[-1]) - self.t_ns) / 1e9
        if last is not None and until - last > ending.clears - ending.verdict:
            found.append(last)
        return found


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
