"""The drawing core: messages in, drawings out; no bus, clock or viewer of its own.

`Dashboard.show` takes one message and draws at most some text; samples wait in batches until
`flush`. Live, the process calls `flush` a few times a second; for a recording, at intervals.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import rerun as rr

from rigwatch.dashboard.board import entities as at
from rigwatch.dashboard.board import log_lines, quantities
from rigwatch.dashboard.board.batches import Batches
from rigwatch.dashboard.board.facts import Facts
from rigwatch.dashboard.board.health import counters, entity
from rigwatch.dashboard.board.lanes import Lanes
from rigwatch.dashboard.board.layout import Windows, blueprint
from rigwatch.dashboard.board.status import advice, status
from rigwatch.dashboard.board.survey import PlotPlan, Survey
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.messages import (
    MOST_FIGURES,
    MOST_SOURCES,
    Alarm,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    RunInfo,
    SampleBlock,
    is_remembered,
)

APPLICATION = "rigwatch"
_WORDS_EVERY_NS = 500_000_000
_LAYOUT_EVERY_NS = 2_000_000_000
SET_BACK_NS = 10_000_000_000
"""How far samples go back, at least, if their clock was set back; late ones are not that old."""


class Dashboard:
    """Draws the messages of one rig into one Rerun recording.

    Args:
        stream: target, already connected to a viewer or a file.
        facts: known facts, updated in place.
        windows: time span of the plots.
        bare: hide the controls of the viewer, for pictures.

    Attributes:
        began_ns, now_ns: first and newest time drawn [ns].
        set_back: the clock of the samples was set back. A viewer follows the newest time, and would
            show nothing of what comes: it needs another recording.
    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        facts: Facts,
        windows: Windows | None = None,
        *,
        bare: bool = False,
    ) -> None:
        self.facts = facts
        self.began_ns = self.now_ns = 0
        self.set_back = False
        self._stream, self._bare = stream, bare
        self._windows = windows or Windows()
        self._survey, self._batches = Survey(), Batches(facts.marks)
        self._plan: tuple[PlotPlan, ...] | None = None
        self._lanes = Lanes(stream, facts.book)
        self._said_ns = self._laid_out_ns = 0
        self._finished = False
        self._counters: set[tuple[str, str]] = set()
        self._draw: dict[type[Message], Callable[[Any], None]] = {
            SampleBlock: self._samples,
            EstimateBlock: self._estimates,
            Alarm: self._alarm,
            Health: self._health,
            Event: self._event,
            Gap: self._gap,
            RunInfo: self._run,
        }
        self._lay_out()
        stream.log(at.WAITING, _markdown(advice(facts)), static=True)

    def show(self, message: Message) -> None:
        """Process one message of any topic; kinds that are not drawn are ignored."""
        if draw := self._draw.get(type(message)):
            draw(message)
            self._keep_up()

    def flush(self, now_ns: int | None = None) -> None:
        """Send waiting data, update the layout if needed, refresh the text.

        Args:
            now_ns: current time [ns], to detect silence; None for recordings.
        """
        self.facts.tell_time(now_ns)
        self._batches.send(self._stream, self._survey.plots)
        self._lay_out()
        self._keep_up(changed=self.facts.silent_s > 0)

    def finish(self) -> None:
        """Draw the remainder of a recording."""
        self._finished = True
        self.flush()

    def _keep_up(self, *, changed: bool = False) -> None:
        """Update verdict and text, but not with every message."""
        if self.now_ns and (changed or self.now_ns - self._said_ns >= _WORDS_EVERY_NS):
            self._lanes.verdict(self.facts.verdict(), self.now_ns)
            self._say()

    def _samples(self, block: SampleBlock) -> None:
        self.set_back |= self.facts.is_earlier(block, SET_BACK_NS)
        plots = quantities.plots_of(block.channels, quantities.SAMPLE_PLOTS, "signals")
        self._plot(plots, block.t_ns, block.channels)
        self.facts.see_samples(block)

    def _estimates(self, block: EstimateBlock) -> None:
        plots = quantities.plots_of(block.columns, quantities.ESTIMATE_PLOTS, quantities.DETAILS)
        self._plot(plots, block.t_ns, block.columns)
        self.facts.see_estimates(block)

    def _plot(
        self, plots: list[quantities.Plot], t_ns: IntArray, columns: Sequence[Column]
    ) -> None:
        if len(t_ns):
            for plot in plots:
                self._survey.see(plot, columns, self._batches.add(plot, t_ns, columns))
            self._reach(int(t_ns[0]), int(t_ns[-1]))

    def _alarm(self, alarm: Alarm) -> None:
        self.facts.book.record(alarm)
        self._reach(alarm.t_ns, alarm.t_ns)
        self._lanes.alarm(alarm)
        self._line(at.LOG, alarm.t_ns, log_lines.alarm_line(alarm), log_lines.alarm_level(alarm))
        self._keep_up(changed=True)

    def _health(self, health: Health) -> None:
        if not is_remembered(self.facts.health, health.source):
            return
        self.facts.health[health.source] = health
        self._at(health.t_ns)
        for view, name, value in counters(health):
            if (view, name) not in self._counters:
                if len(self._counters) >= MOST_SOURCES * MOST_FIGURES:
                    continue
                self._add_counter(view, name)
            self._stream.log(entity(view, name), rr.Scalars(value))

    def _add_counter(self, view: str, name: str) -> None:
        place = sum(known == view for known, _ in self._counters)
        self._counters.add((view, name))
        line = rr.SeriesLines(colors=quantities.colour_at(place), names=name)
        self._stream.log(entity(view, name), line, static=True)

    def _event(self, event: Event) -> None:
        self.facts.book.hear(event)
        text = f"{event.source}: {event.text}"
        self._line(at.EVENTS, event.t_ns, text, log_lines.LEVELS[event.severity])

    def _gap(self, gap: Gap) -> None:
        self._line(at.EVENTS, gap.t_ns, log_lines.gap_line(gap), log_lines.LEVELS["warning"])

    def _run(self, run: RunInfo) -> None:
        self.facts.rig = run.rig

    def _line(self, path: str, t_ns: int, text: str, level: str) -> None:
        self._at(t_ns)
        self._stream.log(path, rr.TextLog(text, level=level))

    def _reach(self, first_ns: int, last_ns: int) -> None:
        self.now_ns = max(self.now_ns, last_ns)
        if not self.began_ns:
            self.began_ns = first_ns
            self._lanes.begin(first_ns)

    def _at(self, t_ns: int) -> None:
        self._stream.set_time(at.TIMELINE, timestamp=np.datetime64(t_ns, "ns"))

    def _lay_out(self) -> None:
        """Update the layout if needed; rarely, since it resets the user's choices."""
        plan = self._survey.plan()
        due = not self._plan or self.now_ns - self._laid_out_ns >= _LAYOUT_EVERY_NS
        if plan != self._plan and (due or self._finished):
            self._plan, self._laid_out_ns = plan, self.now_ns
            layout = blueprint(plan, self._windows, bare=self._bare)
            rr.send_blueprint(layout, recording=self._stream)

    def _say(self) -> None:
        self._said_ns = self.now_ns
        self._at(self.now_ns)
        self._stream.log(at.ADVICE, _markdown(advice(self.facts)))
        self._stream.log(at.STATUS, _markdown(status(self.facts)))


def _markdown(text: str) -> rr.TextDocument:
    return rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
