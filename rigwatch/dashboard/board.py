"""The drawing core: messages in, drawings out; no bus, no clock, no viewer of its own.

`Dashboard.show` takes one message and draws at most a few words; samples wait in batches until `flush`. Live, the
process calls `flush` a few times a second; for a recording it is called once in a while.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import rerun as rr

from rigwatch.dashboard import palette, quantities, words
from rigwatch.dashboard.alarm_book import LANES, AlarmBook
from rigwatch.dashboard.batches import Batches
from rigwatch.dashboard.entities import EVENTS, LOG, STATES, STATUS, TIMELINE, WAITING
from rigwatch.dashboard.health import Latency, counters
from rigwatch.dashboard.layout import Windows, blueprint
from rigwatch.dashboard.status import Facts, markdown
from rigwatch.dashboard.survey import PlotPlan, Survey
from rigwatch.wire.messages import (
    Alarm,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Health,
    IntArray,
    Message,
    RunInfo,
    SampleBlock,
)

APPLICATION = "rigwatch"
_STATUS_EVERY_NS = 500_000_000


class Dashboard:
    """Draws the messages of one rig into one Rerun recording.

    Args:
        stream: where to; already connected to a viewer or a file.
        rig: the rig's id.
        windows: how much time the plots show.
        live: whether the screen follows the newest data.
    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        rig: str,
        windows: Windows | None = None,
        *,
        live: bool = True,
    ) -> None:
        self.facts = Facts(rig, AlarmBook())
        self.now_ns = 0
        self._windows = windows or Windows()
        self._live = live
        self._survey = Survey()
        self._latency = Latency()
        self._lanes: list[str] = []
        self._kinds: dict[type[Message], Callable[[Any], None]] = {
            SampleBlock: self._samples,
            EstimateBlock: self._estimates,
            Alarm: self._alarm,
            Health: self._health,
            Event: self._event,
            Gap: self._gap,
            RunInfo: self._run,
        }
        self.attach(stream)

    def attach(self, stream: rr.RecordingStream) -> None:
        """Draw into another recording from now on, such as one in a viewer that was started again."""
        self._stream = stream
        self._batches = Batches()
        self._plan: tuple[PlotPlan, ...] | None = None
        self._status_ns = 0
        self._verdict = ""
        self._configure(STATES, palette.VERDICTS)
        lanes, self._lanes = self._lanes or list(LANES), []
        for name in lanes:
            self._lane(name)
        self._send_layout()
        self._send_status()

    def show(self, message: Message, received_ns: int | None = None) -> None:
        """Take one message; kinds that are not drawn are left out.

        Args:
            message: of any topic.
            received_ns: when it came in [ns], where it came live.
        """
        if draw := self._kinds.get(type(message)):
            draw(message)
        if received_ns and isinstance(message, SampleBlock) and len(message):
            self._latency.add(received_ns - int(message.t_ns[-1]))

    def flush(self) -> None:
        """Send what waits; lay out anew where something new has come; renew the verdict."""
        self._batches.send(self._stream, self._survey.plots)
        self._send_layout()
        self._judge()
        if self.now_ns - self._status_ns >= _STATUS_EVERY_NS or not self._live:
            self._send_status()

    def _samples(self, block: SampleBlock) -> None:
        table = quantities.SAMPLE_PLOTS
        known = {plot.key for plot in table}
        others = [c for c in block.channels if c.name not in known]
        plots = quantities.plots_of(block.channels, table)
        plots += [quantities.other_plot(column, i) for i, column in enumerate(others)]
        self._draw(plots, block.t_ns, block.channels)
        self.facts.samples += len(block)

    def _estimates(self, block: EstimateBlock) -> None:
        plots = quantities.plots_of(block.columns, quantities.ESTIMATE_PLOTS)
        self._draw(plots, block.t_ns, block.columns)
        if len(block):
            self.facts.figures.update((c.name, float(c.values[-1])) for c in block.columns)

    def _draw(
        self, plots: list[quantities.Plot], t_ns: IntArray, columns: tuple[Column, ...]
    ) -> None:
        if not len(t_ns):
            return
        for plot in plots:
            self._survey.see(plot, columns, self._batches.add(plot, t_ns, columns))
        self._tick(int(t_ns[-1]))

    def _alarm(self, alarm: Alarm) -> None:
        self.facts.book.record(alarm)
        if alarm.name not in self._lanes:
            self._lane(alarm.name)
        self._at(alarm.t_ns)
        self._stream.log(_lane_path(alarm.name), rr.StateChange(state=alarm.state))
        self._judge()
        self._stream.log(LOG, rr.TextLog(words.alarm_line(alarm), level=words.alarm_level(alarm)))
        self._send_status()

    def _health(self, health: Health) -> None:
        self.facts.health[health.source] = health
        self._at(health.t_ns)
        for path, value in counters(health):
            self._stream.log(path, rr.Scalars(value))

    def _event(self, event: Event) -> None:
        self._at(event.t_ns)
        line = rr.TextLog(f"{event.source}: {event.text}", level=words.LEVELS[event.severity])
        self._stream.log(EVENTS, line)

    def _gap(self, gap: Gap) -> None:
        self._at(gap.t_ns)
        self._stream.log(EVENTS, rr.TextLog(words.gap_line(gap), level="WARN"))

    def _run(self, run: RunInfo) -> None:
        self.facts.rig = run.rig

    def _lane(self, name: str) -> None:
        """A lane on the timeline, in the state that the alarm is in."""
        self._configure(_lane_path(name), palette.STATES)
        self._lanes.append(name)
        if self.now_ns:
            self._begin_lane(name)

    def _configure(self, path: str, looks: Mapping[Any, tuple[str, palette.Colour]]) -> None:
        states = rr.StateConfiguration(
            values=list(looks),
            labels=[label for label, _ in looks.values()],
            colors=np.array(palette.state_colours(looks), np.uint32),
        )
        self._stream.log(path, states, static=True)

    def _begin_lane(self, name: str) -> None:
        last = self.facts.book.last.get(name)
        self._at(self.now_ns)
        state = last.state if last else "normal"
        self._stream.log(_lane_path(name), rr.StateChange(state=state))

    def _judge(self) -> None:
        """Let the verdict's lane follow what the alarms and estimates say."""
        verdict = self.facts.verdict()
        if self.now_ns and verdict != self._verdict:
            self._verdict = verdict
            self._at(self.now_ns)
            self._stream.log(STATES, rr.StateChange(state=verdict))

    def _tick(self, t_ns: int) -> None:
        first, self.now_ns = self.now_ns == 0, max(self.now_ns, t_ns)
        if first:
            for name in self._lanes:
                self._begin_lane(name)

    def _at(self, t_ns: int) -> None:
        self._tick(t_ns)
        self._stream.set_time(TIMELINE, timestamp=np.datetime64(t_ns, "ns"))

    def _send_layout(self) -> None:
        plan = self._survey.plan()
        if plan != self._plan:
            self._plan = plan
            layout = blueprint(plan, self._windows, live=self._live)
            rr.send_blueprint(layout, recording=self._stream)

    def _send_status(self) -> None:
        self._status_ns = self.now_ns
        self.facts.latency_ms = self._latency.figures()
        document = rr.TextDocument(markdown(self.facts), media_type=rr.MediaType.MARKDOWN)
        if self.now_ns:
            self._at(self.now_ns)
            self._stream.log(STATUS, document)
        else:
            self._stream.log(WAITING, document, static=True)


def _lane_path(name: str) -> str:
    return rr.new_entity_path([STATES, name])
