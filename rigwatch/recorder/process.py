"""The recording process: bus ─▶ feed ─▶ store ─▶ session folder.

python -m rigwatch.recorder CONFIG
"""

import contextlib
import hashlib
import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rigwatch.recorder.disk import DiskWatch
from rigwatch.recorder.disk_turns import DiskTurns, take_turns
from rigwatch.recorder.feed import CATCH_UP, Feed
from rigwatch.recorder.folders import (
    LONGEST_BREAK,
    age_of,
    choose,
    last_written_ns,
    new_folder,
    note_last,
)
from rigwatch.recorder.past import PastServer
from rigwatch.recorder.positions import PositionFile, Positions
from rigwatch.recorder.remote_feed import RemoteFeed
from rigwatch.recorder.resuming import of_living
from rigwatch.recorder.retention import DAY, Retention, Thinning, clock_of
from rigwatch.recorder.session_length import SessionLength
from rigwatch.recorder.store import Store
from rigwatch.wire.bus import Bus, joined
from rigwatch.wire.errors import SessionError
from rigwatch.wire.host import (
    Heartbeat,
    Kept,
    Pulse,
    free_share,
    keep_memory_tidy,
    use_few_pools,
    waits_for_samples,
)
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    EVENTS,
    HEALTH,
    RECORDERS,
    RUN,
    Event,
    Health,
    RunInfo,
)
from rigwatch.wire.rig_config import RecorderSection, RigConfig, load_rig, rig_text
from rigwatch.wire.session import run_info

PROCESS, REMOTE = RECORDERS
FeedOf = Callable[..., Feed]
HEALTH_EVERY = 1.0
UNSETTLED_NS = 2_000_000_000
"""Age of messages that count as recorded once the disk has been written [ns]."""
FLUSH = 0.5
"""Time until what was received is on the disk, where the configuration says nothing [s]."""
_OF_FLUSH = 0.8
"""Share of the flush time that one loop iteration waits; the rest is for the disk."""


class Recorder:
    """A rig being recorded.

    Args:
        config: the rig's configuration.
        run: description written at the head of every segment.
        bus: source of the messages.
        catch_up: see `Feed`.
        feed_of: makes the feed of a recorder at the rig's site, as `Feed` does.
    """

    def __init__(
        self,
        config: RigConfig,
        run: RunInfo,
        bus: Bus,
        catch_up: float = CATCH_UP,
        *,
        feed_of: FeedOf = Feed,
    ) -> None:
        self.settings = config.recorder or RecorderSection()
        root, remote = Path(self.settings.folder), self.settings.remote
        place = choose(root, run, math.inf if remote else LONGEST_BREAK)
        place = of_living(bus, place) if place.changed else place
        self.store = Store(place.folder, run, self.settings.segment)
        if remote:
            self.feed: Feed = RemoteFeed(bus, place, catch_up)
        else:
            self.feed = feed_of(bus, place.last, place.positions, catch_up=catch_up)
        self._bus, self._run = bus, run
        self._length = SessionLength(self.settings.session_days, age_of(place.folder, run))
        self._settled = self._noted = 0
        self._disk = DiskWatch()
        self._ages = clock_of(self.settings, config.rig.id, last_written_ns(root, config.rig.id))
        self._retention = Retention(self.settings, config.rig.id)
        self._thinning = Thinning(self.settings, config.rig.id)
        self._told_at = -HEALTH_EVERY
        self._told_trouble = self._trouble()
        self._positions = PositionFile(place.folder)
        self._kept: Positions = {}
        self._taken: Positions = {}
        self._now, self._now_ns = 0.0, 0
        if not remote:
            bus.publish(RUN, run)
            PastServer(bus, root, lambda: self._settled)

    def turn(self, now: float, t_ns: int) -> None:
        """Store received messages; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        self.begin_turn(now, t_ns)
        self.sync()
        self.end_turn()

    def begin_turn(self, now: float, t_ns: int) -> None:
        """Take what was received, and write it unless that begins a file."""
        self._now, self._now_ns = now, t_ns
        for message in self.feed.take():
            self.store.add(message)
        self._taken = self.feed.positions()
        if not self.store.needs_file(now):
            self.store.send(now)

    def sync(self) -> None:
        """Wait for the disk, in any thread."""
        self.store.send(self._now)
        self.store.sync()

    def end_turn(self) -> None:
        """Tell what came of it, and see to the rest."""
        now, t_ns = self._now, self._now_ns
        self._settle(now, t_ns)
        if self._length.is_over(now) and not self.store.failure:
            self._begin_session(now, t_ns)
        share = free_share(self.store.folder)
        self._tell(self._disk.update(share, t_ns))
        due = now - self._told_at >= HEALTH_EVERY
        if due:
            self._tell(self._removed(now, t_ns))
        if due or self._trouble() != self._told_trouble:
            self._told_at, self._told_trouble = now, self._trouble()
            self._bus.publish(HEALTH, self._health(share, t_ns))

    def _removed(self, now: float, t_ns: int) -> list[Event]:
        """Remove and thin what is old, and report it."""
        aged_ns = self._ages.now_ns(now, t_ns)
        said = self._retention.update(now, aged_ns, self.store.folder)
        said += self._thinning.update(now, aged_ns)
        return [replace(event, t_ns=t_ns) for event in said]

    def _trouble(self) -> tuple[bool, int]:
        """What is wrong with the disk; a change is reported at once."""
        return bool(self.store.failure), self._disk.level

    def _settle(self, now: float, t_ns: int) -> None:
        self._tell(self.store.settle(now, t_ns))
        self._note_segment()
        if not self.store.failure:
            self._settled = t_ns - UNSETTLED_NS
        # Without a segment there is no folder yet.
        if not self.store.failure and self.store.segment_count and self._taken != self._kept:
            self._kept = self._taken
            self._positions.save(self._taken)

    def _begin_session(self, now: float, t_ns: int) -> None:
        """Go on in another folder; all that was taken is in the one before."""
        self._length.begin(now)
        self._run = replace(self._run, t_ns=t_ns)
        folder = new_folder(Path(self.settings.folder), self._run)
        with contextlib.suppress(SessionError):  # without an index, the segment is still read
            self.store.move_to(folder, self._run)
        self._positions, self._kept, self._noted = PositionFile(folder), {}, 0
        if not self.settings.remote:
            self._bus.publish(RUN, self._run)

    def _note_segment(self) -> None:
        """Note the session with each segment: somebody may have removed the note."""
        if self.store.segment_count != self._noted and not self.store.failure:
            self._noted = self.store.segment_count
            note_last(self.store.folder, self._bus.rig)

    def _tell(self, events: list[Event]) -> None:
        for event in events:
            # A recorder elsewhere speaks of its own disk, not of that of the rig's recorder.
            own = replace(event, source=self._bus.process)
            self._bus.publish(EVENTS, own)
            self.store.add(own)

    def _health(self, share: float, t_ns: int) -> Health:
        state = "recording" if not self.store.failure else "not recording"
        counters = {
            "samples": float(self.store.samples),
            "lost_samples": float(self.feed.gap_samples),
            "lost_alarms": float(self.feed.lost(ALARMS.name)),
            "lost_estimates": float(self.feed.lost(ESTIMATES.name)),
            "dropped_samples": float(self.store.dropped_samples),
            "dropped_messages": float(self.store.dropped_messages + self.feed.dropped),
            "rejected": float(self.feed.rejected),
            "refused_messages": float(self.feed.refused),
            "foreign_samples": float(self.feed.foreign_samples),
            "foreign_messages": float(self.feed.foreign),
            "questions_refused": float(self._bus.questions_refused),
            "foreign_gaps": float(self.feed.foreign_gaps),
            "segments": float(self.store.segment_count),
            "ages_behind_days": self._ages.lag_s / DAY,
            "free_share": -1.0 if math.isnan(share) else share,
            "disk_trouble": float(bool(self.store.failure) or self._disk.short),
        }
        counters |= self.feed.figures()
        return Health(self._bus.process, t_ns, state, self.store.failure, counters)

    def close(self, now: float, t_ns: int) -> None:
        """Write waiting messages and close the session."""
        self._thinning.close()
        self._ages.note()
        for message in [*self.feed.take(), *self.feed.rest()]:
            self.store.add(message)
        self.feed.close()
        self._tell(self.store.close(now, t_ns))
        # An orderly stop is not a failure: supervisors no longer expect a recording.
        self._bus.publish(HEALTH, Health(self._bus.process, t_ns, "stopped", "", {}))


class _Turn:
    """The turns of a recorder that still keeps its rig; `end` raises what was wrong before."""

    def __init__(self, recorder: Recorder, kept: Kept, bus: Bus, pulse: Pulse) -> None:
        self._recorder, self._kept, self._bus, self._pulse = recorder, kept, bus, pulse
        self._error: Exception | None = None

    def begin(self) -> None:
        """See `disk_turns.Turn`."""
        self._try(self._begin)

    def _begin(self) -> None:
        self._kept.check()
        self._recorder.begin_turn(time.monotonic(), time.time_ns())

    def sync(self) -> None:
        """See `disk_turns.Turn`."""
        if self._error is None:
            self._try(self._recorder.sync)

    def end(self) -> None:
        """See `disk_turns.Turn`."""
        if self._error is not None:
            raise self._error
        self._recorder.end_turn()
        waits = waits_for_samples(connected=self._bus.connected())
        self._pulse.advance(self._recorder.feed.samples, waits)

    def _try(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:  # ends this recording, and no other
            self._error = error


def record(
    config: RigConfig,
    run: RunInfo,
    bus: Bus,
    stop: threading.Event,
    pulse: Pulse,
    *,
    disks: DiskTurns | None = None,
    feed_of: FeedOf = Feed,
    flush: float = FLUSH,
    begins: contextlib.AbstractContextManager[object] | None = None,
) -> Path:
    """Record until `stop` is set, telling `pulse` of each turn; returns the session's folder.

    Args:
        config, run, bus: of the `Recorder`.
        stop: ends the recording.
        pulse: is told of each turn.
        disks: those of the process, if it records several rigs.
        feed_of: see `Recorder`.
        flush: time until what was received is on the disk, if the configuration says nothing [s].
        begins: entered while the recording begins, if there are others.

    Raises:
        SessionError: another process records this rig into the same folder.
    """
    root = Path((config.recorder or RecorderSection()).folder)
    kept = Kept(root / f".{config.rig.id}.lock", f"{root}: recording of {config.rig.id}")
    try:
        # Others wait for their turns: what rings have is taken as their answers come.
        catch_up = CATCH_UP if disks is None else 0.0
        with begins or contextlib.nullcontext():
            recorder = Recorder(config, run, bus, catch_up, feed_of=feed_of)
        pulse.ready(f"recording to {recorder.store.folder}")
        turn = _Turn(recorder, kept, bus, pulse)
        every = (recorder.settings.flush or flush) * _OF_FLUSH
        try:
            if disks is None:
                take_turns(turn, every, stop)
            else:
                disks.serve(turn, root, every, stop)
            pulse.stopping()
        finally:
            recorder.close(time.monotonic(), time.time_ns())
    finally:
        kept.give_up()
    return recorder.store.folder


def process_name(config: RigConfig) -> str:
    """The name of the process that records a rig, beside that of the rig's own site."""
    return REMOTE if config.recorder and config.recorder.remote else PROCESS


def describe_run(path: Path | str, config: RigConfig, notes: str = "") -> RunInfo:
    """The description at the head of a recording made with the configuration at `path`."""
    text = rig_text(path)
    return run_info(
        config.rig.id,
        config.rig.sample_rate,
        notes=notes,
        configuration=text,
        configuration_sha256=hashlib.sha256(text.encode()).hexdigest(),
    )


def run(path: Path | str, stop: threading.Event, notes: str = "") -> Path | None:
    """Record the rig whose configuration is at `path`, until `stop` is set; the session's folder.

    None if no router answered before.

    Raises:
        ConfigError: the configuration is invalid.
        BusError: the router's endpoint is invalid.
        SessionError: see `record`.
    """
    use_few_pools()
    config = load_rig(path)
    with joined(config, process_name(config), stop) as bus:
        if bus is None:
            return None
        keep_memory_tidy(stop)
        return record(config, describe_run(path, config, notes), bus, stop, Heartbeat(PROCESS))
