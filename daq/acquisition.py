"""Turns raw blocks into messages: numbered, time-stamped, calibrated. No bus or device inside.

The path of a block::

    RawBlock ─▶ SequenceTracker ─▶ DeviceClock ─▶ Conditioner ─▶ SampleBlock
                  └▶ Gap, Event      └▶ Event       └▶ quality ─▶ Watch ─▶ Health, Event
"""

from collections.abc import Callable, Mapping

from daq.adapter import RawBlock, picked
from daq.clock import SLOWER, DeviceClock, host_offset_ns
from daq.conditioning import Conditioner
from daq.sequence import Hole, Restart, SequenceTracker
from daq.watch import Link, Watch
from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.messages import (
    BlockSize,
    Event,
    Gap,
    Message,
    Severity,
    pieces,
)
from rigwatch.wire.rig_config import RigConfig

LONGEST_BLOCK = 1024
"""Largest number of samples in a block; many channels make it less, as the bus limits messages."""


class Acquisition:
    """Turns one device's raw blocks into messages.

    Args:
        config: the rig.
        clock_rate: device microseconds in a microsecond of the host, from the adapter.
        host_offset_ns: Unix time less monotonic time of the host [ns].

    Attributes:
        samples: number of samples so far.
        longest: most samples that a message takes; 0 before the first one.
    """

    def __init__(
        self,
        config: RigConfig,
        clock_rate: float = 1.0,
        host_offset_ns: Callable[[], int] = host_offset_ns,
    ) -> None:
        rate = config.rig.sample_rate
        self.device = config.daq.name
        self.source = f"daq/{config.daq.name}"
        self.samples = 0
        self.longest = 0
        self._host_offset_ns = host_offset_ns
        self.clock = DeviceClock(rate, clock_rate, host_offset_ns())
        self.tracker = SequenceTracker(rate)
        self.conditioner = Conditioner(config.channels, config.daq.name)
        self.watch = Watch(self.source, rate, config.stale_after, clock_rate)

    def update(self, raw: RawBlock) -> list[Message]:
        """The messages for `raw`, in order: samples, with gaps and events between them."""
        messages: list[Message] = []
        now_ns = int(raw.arrived_ns[-1]) if len(raw) else 0
        for step in self.tracker.accept(raw):
            if isinstance(step, Hole):
                messages.append(self._gap(step, now_ns))
            elif isinstance(step, Restart):
                messages += self._restarted(step, now_ns)
            else:
                messages += self._samples(step)
        return messages

    def tick(self, now_ns: int, link: Link, counters: Mapping[str, float]) -> list[Message]:
        """Time-driven work: silence detection, and health once a second.

        Args:
            now_ns: the host's monotonic clock [ns].
            link: state of the connection.
            counters: the adapter's own.
        """
        stepped = self._wall_clock_step(now_ns)
        figures = {
            **counters,
            "lost_samples": self.tracker.lost,
            "duplicates": self.tracker.duplicates,
            "foreign_samples": self.tracker.foreign,
            "drift_ppm": self.clock.drift_ppm,
            "certain_drift_ppm": self.clock.certain_drift_ppm,
            "clock_jumps": self.clock.jumps,
            "stamps_ahead_s": self.clock.ahead_s,
        }
        return [*stepped, *self.watch.tick(now_ns, self.clock.unix_ns(now_ns), link, figures)]

    def tick_quietly(self, now_ns: int) -> bool:
        """`tick` of a device that is open, its line in order; False if there is more to do."""
        return self.clock.agrees(self._host_offset_ns()) and self.watch.tick_quietly(now_ns)

    def patience(self, now_ns: int) -> float:
        """Longest wait for the device before `tick` is due again [s]."""
        return self.watch.silent_in(now_ns)

    def _wall_clock_step(self, now_ns: int) -> list[Message]:
        step = self.clock.follow(self._host_offset_ns(), now_ns)
        if step == 0.0:
            return []
        text = f"the host's clock was stepped by {step:+.3f} s"
        if ahead := self.clock.ahead_s:
            slower = f"lose {1e3 * SLOWER:g} ms a second until they are right"
            text += f"; stamps are {ahead:.3f} s ahead and {slower}"
        elif step < 0.0:
            text += "; stamps are set back with it"
        return [self._event(now_ns, "warning", "clock_step", text)]

    def _samples(self, run: RawBlock) -> list[Message]:
        messages: list[Message] = []
        for start in range(0, len(run), LONGEST_BLOCK):
            whole = len(run) <= LONGEST_BLOCK
            part = run if whole else picked(run, slice(start, start + LONGEST_BLOCK))
            stamps, jump = self.clock.stamp(part)
            if jump:
                messages.append(self.clock_jumped(jump, int(part.arrived_ns[0])))
            block = self.conditioner.condition(part, stamps)
            self.samples += len(block)
            self.watch.saw(block, int(part.arrived_ns[-1]), self.clock.unix_ns(0))
            self.longest = self.longest or BlockSize.of(block).samples_in(MAX_PAYLOAD)
            messages += pieces(block, self.longest)
        return messages

    def clock_jumped(self, jump: float, now_ns: int) -> Event:
        """The remark on a jump of the device's clock [s] at a monotonic time of the host [ns]."""
        text = f"the device's clock jumped by {jump:+.6f} s, its time is anchored anew"
        return self._event(now_ns, "warning", "clock_jump", text)

    def _restarted(self, restart: Restart, now_ns: int) -> list[Message]:
        self.clock.restart()
        if not restart.reason:
            return []
        text = f"{restart.reason}: boot {restart.boot:08x} follows {restart.before:08x}"
        return [self._event(now_ns, "warning", "boot_changed", text)]

    def _gap(self, hole: Hole, now_ns: int) -> Gap:
        known = hole.last >= hole.first
        reason = "not received from the device" if known else "the device started anew"
        t_ns = self.clock.unix_ns(now_ns)
        return Gap(self.device, hole.boot, hole.first, hole.last, t_ns, self.source, reason)

    def _event(self, now_ns: int, severity: Severity, code: str, text: str) -> Event:
        return Event(self.source, self.clock.unix_ns(now_ns), severity, code, text)
