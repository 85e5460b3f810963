"""What is currently known of the rig: no drawing, bus or clock."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rigwatch.dashboard.board.alarm_book import LANES, AlarmBook
from rigwatch.dashboard.board.palette import VERDICTS
from rigwatch.wire.bus import ShelvedAlarm
from rigwatch.wire.messages import EstimateBlock, Health, SampleBlock, is_of_structure

SILENCE = 2.0
"""Time without samples, or of samples without estimates, after which the screen reports it [s]."""
_BLOCKS = 3
"""Blocks of samples without estimates that are no delay, however far apart a device's are."""
_FORGET = 0.02


@dataclass(slots=True)
class Age:
    """Age of the newest sample on the screen: current, mean and worst [ms]."""

    now: float = 0.0
    mean: float = 0.0
    worst: float = 0.0
    known: bool = False

    def add(self, age_ms: float) -> None:
        """Record the age at one update."""
        self.mean = age_ms + (1 - _FORGET) * (self.mean - age_ms) if self.known else age_ms
        self.now, self.worst, self.known = age_ms, max(self.worst, age_ms), True


@dataclass(slots=True)
class Facts:
    """The facts behind the text on the screen.

    Attributes:
        rig: the rig's id.
        book: states of the alarms.
        shelf: the shelved alarms; live only.
        health: last health message of each process, by source.
        figures: last value of each estimate, by column name.
        age: age of the newest sample drawn; live only.
        marks: constant figures of the model, such as "theta1_signature".
        model: the model's name.
        silent_s: time without samples [s], 0 while they come.
        unwatched_s: length of the newest samples without estimates [s], 0 while these come.
        skipped: messages that the dashboard left out because it was slow.
        lost_alarms: alarms that never reached this screen.
        samples: samples drawn.
    """

    rig: str
    book: AlarmBook = field(default_factory=AlarmBook)
    shelf: list[ShelvedAlarm] = field(default_factory=list)
    health: dict[str, Health] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)
    age: Age = field(default_factory=Age)
    marks: Mapping[str, float] = field(default_factory=dict)
    model: str = ""
    silent_s: float = 0.0
    unwatched_s: float = 0.0
    skipped: int = 0
    lost_alarms: int = 0
    samples: int = 0
    _newest_ns: int = 0
    _fresh_ns: int = 0
    _drawn: int = 0
    _unjudged: int = 0
    _unjudged_ns: int = 0
    _live: bool = False

    def see_samples(self, block: SampleBlock) -> None:
        """Record the drawn samples."""
        self.samples += len(block)
        if len(block):
            newest = int(block.t_ns[-1])
            # A clock that is set back adds the block alone.
            since = self._newest_ns if 0 < self._newest_ns < newest else int(block.t_ns[0])
            self._unjudged += 1
            self._unjudged_ns += newest - since
            self._newest_ns = newest
        if not self._live:
            self._look_for_estimates()

    def is_earlier(self, block: SampleBlock, by_ns: int) -> bool:
        """Whether a block is that much earlier than the samples before it [ns]."""
        return len(block) > 0 and int(block.t_ns[0]) < self._newest_ns - by_ns

    def see_estimates(self, block: EstimateBlock) -> None:
        """Record the last estimates."""
        if not is_of_structure(block):
            self._unjudged = self._unjudged_ns = 0
        for column in block.columns if len(block) else ():
            if np.isfinite(value := column.values[-1]):
                self.figures[column.name] = float(value)

    def tell_time(self, now_ns: int | None) -> None:
        """Record how old the newest sample is, and whether samples and estimates still arrive.

        Live, what has arrived is drawn topic by topic, samples before their estimates: only here
        all of it is drawn.
        """
        if now_ns is None or not self.samples:
            return
        self._live = True
        self._look_for_estimates()
        if self.samples > self._drawn:
            self._drawn, self._fresh_ns = self.samples, now_ns
            self.age.add((now_ns - self._newest_ns) / 1e6)
        silent = (now_ns - self._fresh_ns) / 1e9
        self.silent_s = silent if silent > SILENCE else 0.0

    def _look_for_estimates(self) -> None:
        """Note how long samples have come without estimates, after some came."""
        unwatched = self.figures and self._unjudged >= _BLOCKS
        length = self._unjudged_ns / 1e9 if unwatched else 0.0
        self.unwatched_s = length if length > SILENCE else 0.0

    def verdict(self) -> str:
        """The verdict as one of `palette.VERDICTS`."""
        if faults := self.book.faults():
            name = faults[0].name.partition(".")[0]
            return name if name in VERDICTS else "fault"
        if self.silent_s:
            return "stale"
        if self.unwatched_s:
            return "unwatched"
        if any(alarm.name in LANES for alarm in self.book.unseen()):
            return "over"
        if self.book.remarks():
            return "no_verdict"
        return self._calm()

    def _calm(self) -> str:
        if not self.figures:
            return "waiting"
        if not self.figures.get("armed", 1.0):
            return "learning"
        return "healthy" if self.figures.get("observable", 1.0) else "no_verdict"
