"""The monitor as a process: samples in, estimates and alarms out, alarms kept through restarts.

samples ─▶ RigMonitor ─▶ estimates, alarms, events
commands ─▶ alarms ─┘          link, silence, losses ─▶ alarms
"""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path

from monitor.alarms import AlarmJournal, Announcement, just_returned, read_end, unsaid
from monitor.detectors import FRICTION, detectors_of
from monitor.diagnosis import Explainer
from monitor.model import RigModel, load_model
from monitor.pipeline import (
    Judged,
    Ready,
    RigMonitor,
    compile_kernels,
    compile_together,
    judge_alone,
    ready_of,
)
from monitor.process.cursor import Cursor
from monitor.process.handover import Passed, Rested
from monitor.process.health import HealthBook
from monitor.process.key_watch import KeyWatch
from monitor.process.link_watch import (
    OF_OTHERS,
    LinkWatch,
    Report,
    Seen,
    device_reports,
    disk_reports,
    occasion,
)
from monitor.process.model_requests import ModelDesk, Place
from monitor.process.operator_desk import OperatorDesk, shelf_of
from monitor.process.presence import Presence
from monitor.process.rig_time import RigTime
from monitor.process.startup_grace import Patience
from monitor.signals import MONITOR_RESET
from rigwatch.wire.bus import (
    Bus,
    CommandCheck,
    KeptMessages,
    joined,
    serve_alarm_list,
    serve_shelf,
)
from rigwatch.wire.delivery import POSITION_WRONG, Item, SampleReader
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.host import (
    DEVICE_SILENT,
    MONITOR,
    NO_ROUTER,
    NO_SAMPLES,
    Heartbeat,
    Kept,
    both_clocks,
    keep_large_pieces_apart,
    prepare_for_real_time,
    raise_priority,
    set_at_signal,
    tidy_memory,
    unless_ended,
)
from rigwatch.wire.messages import (
    ALARMS,
    ALIVE_KEY,
    ESTIMATES,
    EVENTS,
    HEALTH,
    MODELS,
    Alarm,
    EstimateBlock,
    Event,
    Form,
    Gap,
    Health,
    SampleBlock,
    cut,
    encode,
    pieces,
)
from rigwatch.wire.rig_config import MonitorSection, RigConfig, load_rig, section_or_error

TURN = 0.02
"""Longest wait for samples before commands and silence are checked [s]."""
LONGEST_BLOCK = 512
"""Number of samples processed and published per step while the monitor catches up."""
ABSENT = "not there"
"""Stands for the reason of an absence that is not told."""


class MonitorProcess:
    """The resources of one run of the monitor.

    Args:
        config: the rig's configuration, with a section [monitor].
        path: its file, for errors.
        model: from `suitable_model`.
        bus: source of samples and destination of results.

    Raises:
        ConfigError: a section of [monitor.alarms] names no alarm, or a detector does not suit.
        SessionError: journal or cursor cannot be opened, or another process keeps them.
    """

    def __init__(self, config: RigConfig, path: Path | str, model: RigModel, bus: Bus) -> None:
        section = monitor_section(config, path)
        detectors = detectors_of(section.detectors, model, path)
        friction = FRICTION in section.detectors
        self.rig = RigMonitor(model, section.alarms, detectors, str(path), friction)
        self.bus = bus
        self._alone, self._journal, self._cursor, self._said = _opened(section.journal)
        try:
            self._begin(config, section)
        except BaseException:
            self._give_up()
            raise

    def _begin(self, config: RigConfig, section: MonitorSection) -> None:
        """Join the bus with what the rig's files say."""
        bus = self.bus
        self._done = self._cursor.read() if self._cursor else None
        self._stale_after = config.stale_after
        self._time = RigTime(*both_clocks())
        self._links = LinkWatch(self._stale_after)
        self._keys = KeyWatch(config.bus.security.keys)
        self._health = HealthBook("monitor")
        self._device = config.daq.name
        self._patience = Patience(time.monotonic())
        self._daq_presence, self._recorder_presence = Presence(), Presence()
        self._daq_trouble = ""
        self._daq: Health | None = None
        self._delivered_s = self._estimated_s = 0.0
        self._router_lost_at: float | None = None
        self._recorder: Health | None = None
        self._unsuitable, self._link_holds, self._others_trouble = "", True, False
        self._standing = self.rig.alarms.standing()
        check = CommandCheck(bus, config.bus.security)
        self._operators = OperatorDesk(bus, check)
        bus.announce(self._said)
        self._of_daq = bus.subscribe_own(HEALTH, "daq")
        self._of_recorder = bus.subscribe_own(HEALTH, "recorder")
        self._follow("daq", self._daq_presence)
        self._follow("recorder", self._recorder_presence)
        self._explainer = Explainer(lambda: self.rig.model, section.effect_files)
        if self._journal:
            newest = self._journal.newest()
            standing = self.rig.alarms.restore(newest, time.time_ns())
            self.say([*just_returned(newest), *standing])
            self._standing = self.rig.alarms.standing()
        self._shelf = shelf_of(self.rig.alarms)
        # Only now: before, an answer would say that no alarm stands.
        serve_alarm_list(bus, lambda: self._explainer.with_causes(self._standing))
        serve_shelf(bus, lambda: self._shelf)
        self._models = ModelDesk(bus, self.rig, Path(section.model), check)
        self._judged_ns = 0
        self.reader = SampleReader(bus, self._done, config.daq.ring if self._done else 0)

    def take(self, item: SampleBlock | Gap | Event) -> None:
        """Process one item from the reader."""
        if isinstance(item, SampleBlock):
            for block in pieces(item, LONGEST_BLOCK):
                self._judge(block)
        elif isinstance(item, Gap):
            self._links.lost(max(0, item.last - item.first + 1), time.monotonic_ns())
        elif item.code == POSITION_WRONG:
            self._done = None
            if self._cursor:
                self._cursor.set_aside()

    def turn_s(self) -> float:
        """Longest wait for samples: less than a turn if silence becomes an alarm sooner [s]."""
        left = self._stale_after - self.reader.silent_for()
        return min(left, TURN) if left > 0.0 else TURN

    def waits(self) -> str:
        """Why there are no samples to come; empty if daq runs and has some of its device."""
        if not self._daq_there():
            return self._absence("daq")
        silent = self._daq is not None and self._daq.state in DEVICE_SILENT
        return self._daq_trouble or (NO_SAMPLES if silent else "")

    def keep_position(self) -> None:
        """Store the position; all samples read so far have been processed.

        While those before it are read again for the filters, the earlier run's remains.
        """
        position = self._last_judged()
        if self._cursor and position and position == self.reader.position:
            self._cursor.write(*position)

    def _last_judged(self) -> tuple[int, int] | None:
        """(boot, seq) of the last sample that was judged, by this run or the one before it."""
        position, done = self.reader.position, self._done
        again = position and done and position[0] == done[0] and position < done
        return done if again else position

    @property
    def is_quiet(self) -> bool:
        """Whether the last look around has found no trouble with the samples, and no ranking is to
        begin; the alarms of recording and device may hold.
        """
        calm = not self._link_holds and not self._unsuitable
        return calm and not self._explainer.waits_for_samples

    def open_row(self, suits: Callable[[Form], bool]) -> Rested | None:
        """Leave samples to a row of a table, if they simply follow and nothing else happens.

        All that was read has been judged. What the row does is told by `went_on` before anything
        else is done here.

        Args:
            suits: whether blocks of a form can be judged there.
        """
        place = self._last_judged()
        if not self.is_quiet or place is None or not self._time.is_near(*both_clocks()):
            return None
        boot, following = place[0], place[1] + 1
        state = self.rig.at_rest(boot, following)
        if state is None or self.reader.open_row(suits) != place:
            self.reader.close_row()
            return None
        return Rested(self.reader.device, boot, following, state, self._time.offset_ns)

    def went_on(self, passed: Passed) -> None:
        """A row has judged samples since `open_row`, and published their estimates."""
        self.rig.went_on(passed.samples, passed.boot, passed.following, passed.t_ns)
        self._judged_ns = passed.t_ns
        self._time.follow(passed.offset_ns)
        self._delivered_s += passed.samples / self.rig.model.sample_rate
        self._estimated_s = self._delivered_s
        self._health.judged_after(passed.latencies_ms)

    def keep_for_ranking(self, estimates: EstimateBlock, samples: SampleBlock) -> None:
        """Keep what a row has judged."""
        self._explainer.take(estimates, samples)

    @property
    def loose_samples(self) -> int:
        """Samples that are kept for a ranking in blocks as they came."""
        return self._explainer.loose

    @property
    def cursor(self) -> Cursor | None:
        """Where the position is kept."""
        return self._cursor

    def is_calm(self, silent_s: float) -> bool:
        """Whether a look around would find what the last one found, and nothing to tell.

        Args:
            silent_s: time since the last sample [s].
        """
        return (
            not self._link_holds
            and silent_s <= self._stale_after
            and self._hears_nothing_new()
            and not self._operators.has_some
            and not self._models.has_some
            and not self._explainer.has_results
            and not self.reader.may_hold()
        )

    @property
    def health_is_due(self) -> bool:
        """Whether a second has passed since the last health message."""
        return self._health.will_be_due(time.monotonic_ns())

    def tell_health(self) -> bool:
        """Do what a look around does for a rig that is calm; whether a row may go on with it.

        What the row has done has been told.
        """
        now_ns = self._now_ns()
        seen = self._seen()
        self.say(self.rig.alarms.pass_to(now_ns))
        self._shelf = shelf_of(self.rig.alarms)
        self._announce_clock_step(seen)
        if self._health.is_due(seen.monotonic_ns):
            self._tell_health(seen, waiting=0)
        boot, last = self._last_judged() or (0, -1)
        at_rest = self.rig.at_rest(boot, last + 1) is not None
        return at_rest and not self._changes(self._reports(seen))

    def _changes(self, reports: Iterable[Report]) -> bool:
        """Whether an alarm has to be raised, or has gone."""
        return any(self.rig.alarms.holds(name) != holds for name, _, holds in reports)

    def _hears_nothing_new(self) -> bool:
        """Whether daq and recorder say nothing, or nothing that has to be told."""
        there = self._recorder is None or self._recorder_presence.has_token
        if self._of_daq.may_hold() or self._of_recorder.may_hold():
            self._hear_of_others()
        elif there and not self._others_trouble:
            return True
        if self._daq_trouble or self._two_devices:
            return False
        return not self._changes(self._reports_of_others(why=False))

    def look_around(self) -> None:
        """Execute commands, check the link, publish the health."""
        self._link_holds = True
        now_ns = self._now_ns()
        for announced in self._operators.execute(self.rig.alarms, now_ns, self._last_judged()):
            self.say(announced)
        self._change_models()
        for event in self._explainer.results():
            self.bus.publish(EVENTS, event)
        seen = self._seen()
        self.say(self.rig.alarms.pass_to(now_ns))
        reports = [*self._reports(seen)]
        for name, cause, holds in reports:
            if self.rig.alarms.holds(name) != holds:
                at = occasion(seen, cause, now_ns)
                self.say(self.rig.alarms.report(name, at, active=holds))
        if reason := self._links.lasting_reason(seen):
            self.say(self.rig.alarms.reword("link", reason, now_ns))
        self._shelf = shelf_of(self.rig.alarms)
        self._announce_router(seen)
        self._announce_clock_step(seen)
        if self._health.is_due(seen.monotonic_ns):
            self._tell_health(seen, len(self.reader))
        held = {name for name, _, holds in reports if holds}
        self._others_trouble = not held.isdisjoint(OF_OTHERS)
        self._link_holds = bool(held - OF_OTHERS) or self._router_lost_at is not None

    def _now_ns(self, sample_ns: int | None = None) -> int:
        """The time by which alarms count [ns]; `sample_ns` is that of a sample that has come."""
        wall_ns, monotonic_ns = both_clocks()
        if back_ns := self._time.set_back(wall_ns, monotonic_ns, sample_ns):
            self.rig.alarms.set_back(back_ns)
        return self._time.now(monotonic_ns)

    def _reports(self, seen: Seen) -> Iterator[Report]:
        """The alarms that no sample raises."""
        yield from self._links.reports(seen)
        yield from self._reports_of_others()
        yield from self._keys.reports(seen)

    def _reports_of_others(self, *, why: bool = True) -> Iterator[Report]:
        """The alarms of what daq and recorder have said last, and of the journal.

        Args:
            why: with the reason of an absence, which asks for the router.
        """
        unjudged = self._delivered_s - self._estimated_s
        yield from device_reports(self._daq, unjudged, self._unsuitable)
        failure = self._journal.failure if self._journal else ""
        there = self._recorder_presence.holds(time.monotonic())
        absence = "" if there else self._absence("recorder") if why else ABSENT
        yield from disk_reports(self._recorder, absence, failure)

    def _announce_router(self, seen: Seen) -> None:
        """Report to subscribers that the router was unavailable."""
        if not self.bus.connected():
            self._router_lost_at = self._router_lost_at or time.monotonic()
        elif self._router_lost_at is not None:
            away, self._router_lost_at = time.monotonic() - self._router_lost_at, None
            text = f"the router was away for {away:.1f} s; messages from that time follow"
            self.bus.publish(EVENTS, Event("monitor", seen.t_ns, "warning", "ROUTER BACK", text))

    def _announce_clock_step(self, seen: Seen) -> None:
        if step := self._links.clock_step(seen):
            text = f"the wall clock was set by {step / 1e9:+.1f} s"
            self.bus.publish(EVENTS, Event("monitor", seen.t_ns, "warning", "CLOCK STEP", text))

    def say(self, announcements: Iterable[Announcement]) -> None:
        """Write changes to the journal, then list and publish them."""
        if changes := self.rig.alarms.take_changes():
            if self._journal:
                self._journal.write(changes)
            self._standing = self.rig.alarms.standing()
        for said in announcements:
            if isinstance(said, Alarm):
                self._explainer.hear(said)
                self._tell_reset(said)
            self.bus.publish(ALARMS if isinstance(said, Alarm) else EVENTS, said)

    def _tell_reset(self, alarm: Alarm) -> None:
        if alarm.name == MONITOR_RESET and alarm.state == "unacknowledged":
            text = f"filters were reset at sample {alarm.seq} of boot {alarm.boot}"
            self.bus.publish(EVENTS, Event("monitor", alarm.t_ns, "error", "MONITOR RESET", text))

    def close(self) -> None:
        """Close all resources."""
        self.reader.close()
        self._explainer.close()
        self._models.close()
        self._give_up()

    def _give_up(self) -> None:
        """Close the rig's files, its lock last."""
        for kept in (self._journal, self._cursor, self._said):
            if kept:
                kept.close()
        if self._alone:
            self._alone.give_up()

    def _change_models(self) -> None:
        """Apply model changes; all samples read so far have been processed."""
        boot, last = self.reader.position or (0, -1)
        at = self._judged_ns + 1 if last >= 0 else time.time_ns()
        for change in self._models.changes(Place(self._device, boot, last + 1, at)):
            self.bus.publish(MODELS, change)
            text = f"{change.text} ({change.user}, {change.identity}), from sample {change.seq} on"
            self.bus.publish(EVENTS, Event("monitor", at, "info", "MODEL", text))

    def _judge(self, block: SampleBlock) -> None:
        self._count(block)
        known = self._known_of(block)
        try:
            if known:
                self.rig.learn(cut(block, 0, known))
            fresh = cut(block, known, len(block)) if known else block
            judged = judge_alone(self.rig, fresh) if len(fresh) else None
        except KeyError as error:
            self._unsuitable = f"samples without the channel {error} that the model needs"
            return
        self._unsuitable = ""
        if judged is None:
            if not len(fresh):
                self._estimated_s = self._delivered_s
            return
        self._tell(fresh, judged)

    def ready(self, item: Item) -> Ready | None:
        """An item, if it is a block that can be judged together with those of other rigs."""
        if not isinstance(item, SampleBlock) or self._known_of(item):
            return None
        return ready_of(self.rig, item)

    def take_judged(self, block: SampleBlock, judged: Judged) -> None:
        """Process a block that has been judged together with those of other rigs."""
        self._count(block)
        self._unsuitable = ""
        self._tell(block, judged)

    def _count(self, block: SampleBlock) -> None:
        self._judged_ns = int(block.t_ns[-1])
        self._now_ns(self._judged_ns)
        self._delivered_s += len(block) / self.rig.model.sample_rate

    def _tell(self, fresh: SampleBlock, judged: Judged) -> None:
        """Publish the results of new samples."""
        self._estimated_s = self._delivered_s
        self.bus.publish(ESTIMATES, judged[0])
        self._explainer.take(judged[0], fresh)
        self._health.judged(self._judged_ns, time.time_ns())
        self.say(self.rig.announce(*judged))

    def _known_of(self, block: SampleBlock) -> int:
        """Number of the block's samples that an earlier run has processed."""
        if self._done is None or self._done[0] != block.boot:
            return 0
        return max(0, min(len(block), self._done[1] + 1 - block.seq))

    def _follow(self, process: str, presence: Presence) -> None:
        def changed(_key: str, alive: bool) -> None:
            presence.token(time.monotonic(), alive=alive)

        self.bus.watch_tokens(f"{ALIVE_KEY}/{process}", changed)

    def _absence(self, process: str) -> str:
        """Why a process is not seen: without a router nobody is."""
        there = self.bus.connected()
        return f"the {process} process is not there" if there else NO_ROUTER

    def _daq_there(self) -> bool:
        now = time.monotonic()
        if self.reader.heard:
            self._daq_presence.heard(now - self.reader.silent_for())
        return self._daq_presence.holds(now)

    def _hear_of_others(self) -> None:
        for health in self._of_daq.drain():
            self._daq = health
            self._daq_trouble = health.text if health.state == "reconnecting" else ""
        for health in self._of_recorder.drain():
            self._recorder = None if health.state == "stopped" else health
            self._recorder_presence.heard(time.monotonic())

    @property
    def _two_devices(self) -> bool:
        """Whether daq says that two devices speak."""
        return self._daq is not None and self._daq.state == "two devices"

    def _seen(self) -> Seen:
        self._hear_of_others()
        daq_there = self._daq_there()
        silent = self._patience.counted(
            time.monotonic(),
            self.reader.silent_for(),
            daq_alive=daq_there,
            heard=self.reader.heard,
        )
        return Seen(
            *both_clocks(),
            silent,
            self._daq_trouble if daq_there else self._absence("daq"),
            self.reader.heard,
            self.reader.contested or self._two_devices,
            self._device,
            self.reader.position or (0, -1),
        )

    def _tell_health(self, seen: Seen, waiting: int) -> None:
        """Publish the health, with the number of blocks that wait."""
        if self._alone and self._cursor:
            self._alone.check()
            self._cursor.keep()
        if self._said:
            self._said.write()  # what could not be written before
        stale = seen.silent_s > max(1.0, self._stale_after)
        state = "unsuitable" if self._unsuitable else "stale" if stale else "running"
        text = self._unsuitable or ("no samples arrive" if stale else "")
        if self._journal and self._journal.failure:
            self._journal.write(())  # what waits is not on the disk before that
            text = self._journal.failure or text
        extra = {
            "queue_length": float(waiting),
            "rejected": float(self.reader.rejected),
            "dropped": float(self.reader.dropped),
            **self._operators.counters,
            "questions_refused": float(self.bus.questions_refused),
            **{f"rejected_of_{who}": float(n) for who, n in self.reader.rejected_by.items()},
        }
        self.bus.publish(
            HEALTH, self._health.message(seen.t_ns, state, text, self.reader.counters, extra)
        )


def _opened(
    journal: str,
) -> tuple[Kept | None, AlarmJournal | None, Cursor | None, KeptMessages | None]:
    """Lock, journal, position and sent alarms at a path.

    All or none: a rig that cannot start keeps no file.
    """
    if not journal:
        return None, None, None, None
    with ExitStack() as opened:
        alone = Kept(Path(f"{journal}.lock"), f"{journal}: alarm journal")
        opened.callback(alone.give_up)
        kept = AlarmJournal(journal)
        opened.callback(kept.close)
        cursor = Cursor(f"{journal}.position")
        opened.callback(cursor.close)
        said = _said(journal)
        opened.pop_all()
        return alone, kept, cursor, said


def _said(journal: str) -> KeptMessages:
    """The alarms that the earlier runs have sent, or were about to send."""
    said = KeptMessages(f"{journal}.said")
    left = unsaid(read_end(journal), said.payloads)
    said.complete(None if left is None else [encode(alarm) for alarm in left])
    return said


def monitor_section(config: RigConfig, path: Path | str) -> MonitorSection:
    """The section [monitor].

    Raises:
        ConfigError: there is none.
    """
    section_or_error(config, "monitor", path)
    assert config.monitor is not None
    return config.monitor


def suitable_model(config: RigConfig, path: Path | str) -> RigModel:
    """The model that the configuration at `path` names.

    Raises:
        ConfigError: it cannot be read, or needs channels or a rate that the rig does not have.
    """
    file = monitor_section(config, path).model
    model = load_model(file)
    names = [channel.name for channel in config.channels]
    if missing := [name for name in model.channels if name not in names]:
        raise ConfigError(file, "channels", f"{', '.join(missing)}", f"channels of {path}")
    if model.sample_rate != config.rig.sample_rate:
        found = f"{model.sample_rate:g} Hz"
        raise ConfigError(file, "sample_rate", found, f"{config.rig.sample_rate:g} Hz as in {path}")
    return model


def prepared(config: RigConfig, path: Path | str) -> RigModel:
    """The model of the rig, with all kernels that its monitor needs compiled.

    Raises:
        ConfigError: as in `suitable_model`, or a detector does not suit.
    """
    model = suitable_model(config, path)
    names = monitor_section(config, path).detectors
    detectors = detectors_of(names, model, path)
    compile_kernels(model, detectors)
    if not detectors:
        compile_together(model)
    return model


def watch(process: MonitorProcess, stop: threading.Event) -> None:
    """The loop: samples as they arrive, everything else in between, until `stop` is set."""
    heartbeat = Heartbeat("monitor")
    prepare_for_real_time()
    tidy_memory(stop)
    heartbeat.ready()
    looked = 0.0
    while not stop.is_set():
        items = process.reader.read(process.turn_s())
        for item in items:
            process.take(item)
        process.keep_position()
        # While samples come, not after each of them; silence is looked at without delay.
        if not items or time.monotonic() - looked >= TURN:
            looked = time.monotonic()
            process.look_around()
        heartbeat.advance(process.reader.counters.delivered, process.waits())
    heartbeat.stopping()


def run(path: Path | str) -> int:
    """Monitor the rig at `path` until a signal ends it; the exit code.

    Raises:
        RigwatchError: configuration, model, journal or bus are invalid or unavailable.
    """
    stop = set_at_signal()
    keep_large_pieces_apart()
    config = load_rig(path)
    # Before joining: a monitor that is visible there is ready.
    model = unless_ended(stop, lambda: prepared(config, path))
    raise_priority(MONITOR)
    with joined(config, "monitor", stop) as bus:
        if bus is not None:
            process = MonitorProcess(config, path, model, bus)
            watch(process, stop)
            process.close()
    return 0
