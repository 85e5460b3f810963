"""Summary of a session: rates, gaps, quality, topics, alarms, damage."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import (
    SAID_BY_ANYBODY,
    Alarm,
    Column,
    EstimateBlock,
    Gap,
    Message,
    RunInfo,
    SampleBlock,
    blocks,
)
from rigwatch.wire.messages import quality_flags as quality
from rigwatch.wire.ordering import set_by_ns
from rigwatch.wire.session.losses import Losses, Span, count
from rigwatch.wire.session.reader import LostSpan, Session
from rigwatch.wire.session.writer import message_time


@dataclass(slots=True)
class ChannelSummary:
    """One channel over a session; `low`, `high` and `mean` [unit] are over its good samples.

    Attributes:
        flags: number of samples by quality flag; "good" for none.
    """

    name: str
    unit: str
    low: float = float("nan")
    high: float = float("nan")
    mean: float = float("nan")
    flags: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True)
class DeviceSummary:
    """The samples of one device.

    Attributes:
        samples: number of samples.
        boots: number of starts of the device.
        rate_hz: mean rate inside unbroken stretches, whatever the clock was set by [Hz].
        longest_step_s: longest time between neighbours in a stretch, likewise [s].
        clock_steps: how often the clock of the samples was set.
        gaps: number of gaps in the sequence numbers, reported ones at the end of a start included.
        missing: number of missing samples.
    """

    name: str
    samples: int = 0
    boots: int = 0
    rate_hz: float = 0.0
    longest_step_s: float = 0.0
    clock_steps: int = 0
    gaps: int = 0
    missing: int = 0
    channels: list[ChannelSummary] = field(default_factory=list)


@dataclass(slots=True)
class Summary:
    """The summary of a session.

    Attributes:
        run: description of the run, None if lost.
        start_ns, end_ns: times of the first and last sample, estimate, alarm or change of the
            model; where there is none, of any other message; 0 if there is none either [ns].
        topics: messages per topic.
        unknown_ends: starts of a device whose last samples are missing, number unknown.
        lost_messages: missing messages per topic, for example alarms no longer in any ring.
        lost: damage.
        unclosed: segments without an index, by name.
    """

    path: str
    segments: int
    run: RunInfo | None = None
    start_ns: int = 0
    end_ns: int = 0
    topics: dict[str, int] = field(default_factory=dict)
    devices: list[DeviceSummary] = field(default_factory=list)
    alarms: list[Alarm] = field(default_factory=list)
    unknown_ends: int = 0
    lost_messages: dict[str, int] = field(default_factory=dict)
    lost: tuple[LostSpan, ...] = ()
    unclosed: list[str] = field(default_factory=list)

    @property
    def duration_s(self) -> float:
        """Duration from the first to the last message [s]."""
        return (self.end_ns - self.start_ns) / 1e9


def summarise(session: Session, also: Callable[[Message], None] | None = None) -> Summary:
    """Summarise the whole session.

    Args:
        session: the session.
        also: called with each message, for what else is wanted from the same pass.

    Raises:
        SessionError: a segment cannot be opened.
    """
    summary = Summary(str(session.path), len(session.segments))
    devices: dict[str, _Device] = {}
    times, others = _Times(), _Times()
    counts: Counter[str] = Counter()
    losses = Losses()
    for item in session.messages():
        counts[item.topic.name] += 1
        message = item.message
        if also is not None:
            also(message)
        if isinstance(message, SampleBlock):
            devices.setdefault(message.device, _Device(message.device)).add(message)
            losses.add(message)
        elif isinstance(message, Alarm):
            summary.alarms.append(message)
        elif isinstance(message, Gap):
            losses.add(message)
        if not isinstance(message, RunInfo):  # it may be years older
            # By what a stranger dates fifty years ahead a session would never be old.
            (others if isinstance(message, SAID_BY_ANYBODY) else times).add(message)
    summary.start_ns, summary.end_ns = (times if times.any else others).span
    summary.topics = dict(sorted(counts.items()))
    summary.devices = [
        # A start whose samples are all missing has no device but the only one there is.
        device.result(losses.missing(device.boots if len(devices) > 1 else None))
        for device in devices.values()
    ]
    summary.unknown_ends, summary.lost_messages = losses.unknown_ends, losses.messages
    summary.run = _run(session)
    summary.lost = session.lost
    summary.unclosed = [path.name for path in session.unclosed]
    return summary


def _run(session: Session) -> RunInfo | None:
    try:
        return session.info
    except SessionError:
        return None


class _Times:
    """The time span of some messages."""

    def __init__(self) -> None:
        self.any = False
        self.span = 0, 0
        """Times of the first and the last of them [ns]."""

    def add(self, message: Message) -> None:
        first = last = message_time(message)
        if isinstance(message, SampleBlock | EstimateBlock):
            last = int(message.t_ns[-1]) if len(message) else first
        start, end = self.span
        self.span = (min(start, first), max(end, last)) if self.any else (first, last)
        self.any = True


class _Device:
    """Accumulates the figures of one device."""

    def __init__(self, name: str) -> None:
        self._figures = DeviceSummary(name)
        self._channels: dict[str, _Channel] = {}
        self._next: dict[int, int] = {}
        self._last: tuple[int, int, int, int] | None = None
        self._steps = self._time_ns = 0

    def add(self, block: SampleBlock) -> None:
        known = self._next.get(block.boot)
        part = blocks.unseen(block, known)
        if part is None or not len(part):
            return
        self._figures.boots += known is None
        self._measure_steps(part)
        self._figures.samples += len(part)
        self._next[part.boot] = part.seq + len(part)
        for column in part.channels:
            self._channels.setdefault(column.name, _Channel(column)).add(column)

    def _measure_steps(self, block: SampleBlock) -> None:
        t_ns, device_us = block.t_ns, block.device_us
        if self._last is not None and self._last[:2] == (block.boot, block.seq):
            t_ns = np.concatenate([self._last[2:3], t_ns])
            device_us = np.concatenate([self._last[3:], device_us])
        if len(t_ns) > 1:
            steps = np.diff(t_ns)
            usual = self._time_ns / self._steps if self._steps else float(np.median(steps))
            was_set = set_by_ns(t_ns, device_us, np.arange(len(t_ns)), usual)
            steps = (steps - was_set)[steps >= was_set]
            self._figures.clock_steps += int(np.count_nonzero(was_set))
            longest = int(steps.max(initial=0)) / 1e9
            self._figures.longest_step_s = max(self._figures.longest_step_s, longest)
            self._steps += len(steps)
            self._time_ns += int(steps.sum())
        end = block.seq + len(block)
        self._last = (block.boot, end, int(block.t_ns[-1]), int(block.device_us[-1]))

    @property
    def boots(self) -> tuple[int, ...]:
        return tuple(self._next)

    def result(self, missing: list[Span]) -> DeviceSummary:
        figures = self._figures
        figures.gaps, figures.missing = len(missing), count(missing)
        figures.rate_hz = self._steps / self._time_ns * 1e9 if self._time_ns > 0 else 0.0
        figures.channels = [channel.result() for channel in self._channels.values()]
        return figures


class _Channel:
    """Accumulates the figures of one channel."""

    def __init__(self, column: Column) -> None:
        self._figures = ChannelSummary(column.name, column.unit)
        self._flags: Counter[str] = Counter()
        self._sum, self._good = 0.0, 0

    def add(self, column: Column) -> None:
        usable = np.isfinite(column.values)
        if np.count_nonzero(column.quality):  # most often there is no flag
            self._count(column.quality)
            usable &= quality.valid(column.quality)
        else:
            self._flags["good"] += len(usable)
        good = column.values if usable.all() else column.values[usable]
        if len(good):
            self._figures.low = float(np.fmin(self._figures.low, good.min()))
            self._figures.high = float(np.fmax(self._figures.high, good.max()))
            self._sum += float(good.sum())
            self._good += len(good)

    def _count(self, flags: NDArray[np.uint8]) -> None:
        for bit, name in quality.NAMES.items():
            self._flags[name] += int(np.count_nonzero(flags & bit))
        self._flags["good"] += int(np.count_nonzero(flags == quality.GOOD))

    def result(self) -> ChannelSummary:
        self._figures.mean = self._sum / self._good if self._good else float("nan")
        self._figures.flags = {name: count for name, count in self._flags.items() if count}
        return self._figures
