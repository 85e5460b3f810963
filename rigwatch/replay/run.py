"""Runs the monitor over a session: the same object as live, fed from a file.

session ─▶ samples, commands ─▶ RigMonitor ─▶ estimates, alarms ─▶ caller, new session
"""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from monitor.alarms import Announcement
from monitor.model import RigModel, parse_model
from monitor.pipeline import RigMonitor, Watched
from rigwatch.replay.source import JUDGED_SAMPLES, Item, items
from rigwatch.wire.access import names_a_person
from rigwatch.wire.errors import RigwatchError, SessionError
from rigwatch.wire.messages import (
    NOT_PROVED,
    PROVED,
    Alarm,
    AlarmCommand,
    Event,
    ModelChange,
    SampleBlock,
)
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session import LostSpan, Session, SessionWriter

PACED_BLOCK = 0.05
"""Length of a block in a timed replay [s of the wall clock]."""


@dataclass(slots=True)
class Replay:
    """The result of a replay.

    Attributes:
        samples: number of samples passed to the monitor.
        armed: number of them at which it was armed.
        first_ns, last_ns: times of the first and the last of them [ns].
        elapsed_s: duration of the replay [s].
        alarms: transitions, in order.
        events: the events, in order.
        lost: damage of the session.
    """

    samples: int = 0
    armed: int = 0
    first_ns: int = 0
    last_ns: int = 0
    elapsed_s: float = 0.0
    alarms: list[Alarm] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    lost: tuple[LostSpan, ...] = ()

    def count(self, judged: "Judged") -> None:
        """Add the result of one item."""
        if isinstance(judged.item, SampleBlock):
            self.first_ns = self.first_ns if self.samples else int(judged.item.t_ns[0])
            self.last_ns = int(judged.item.t_ns[-1])
            self.samples += len(judged.item)
        if judged.watched is not None:
            self.armed += int(judged.watched.estimates.column("armed").values.sum())
        for announcement in judged.announced:
            if isinstance(announcement, Alarm):
                self.alarms.append(announcement)
            else:
                self.events.append(announcement)

    @property
    def duration_s(self) -> float:
        """Recorded time [s]."""
        return (self.last_ns - self.first_ns) / 1e9

    @property
    def times_real_time(self) -> float:
        """Recorded time over the duration of the replay."""
        return self.duration_s / self.elapsed_s if self.elapsed_s > 0 else 0.0


def check_suits(session: Session, model: RigModel) -> None:
    """Refuse a model made for another sample rate.

    Raises:
        SessionError: the session's sample rate differs.
    """
    rate = session.info.sample_rate_hz
    if abs(rate - model.sample_rate) > 1e-6 * model.sample_rate:
        found = f"found a session of {rate:g} Hz, expected {model.sample_rate:g} Hz as in the model"
        raise SessionError(f"{session.path}: {found}")


@dataclass(frozen=True, slots=True)
class Judged:
    """One item of a recording and the monitor's output for it."""

    item: Item
    watched: Watched | None
    announced: list[Announcement]


def judge(session: Session, monitor: RigMonitor, found: Iterable[Item]) -> Iterator[Judged]:
    """Pass each item to the monitor.

    Raises:
        SessionError: samples lack a channel that the model needs.
    """
    for item in found:
        if isinstance(item, AlarmCommand):
            yield Judged(item, None, _commanded(monitor, item))
            continue
        if isinstance(item, ModelChange):
            yield Judged(item, None, _adopted(monitor, item, session))
            continue
        try:
            watched = monitor.update(item)
        except KeyError as error:
            names = ", ".join(column.name for column in item.channels)
            text = f"found the channels {names}, expected {error} that the model needs"
            raise SessionError(f"{session.path}: {text}") from None
        yield Judged(item, watched, watched.announcements if watched else [])


def _commanded(monitor: RigMonitor, command: AlarmCommand) -> list[Announcement]:
    return monitor.alarms.command(command, PROVED if names_a_person(command.proof) else NOT_PROVED)


def _adopted(monitor: RigMonitor, change: ModelChange, session: Session) -> list[Announcement]:
    """Continue with the promoted model; report and skip one that no monitor can accept."""
    try:
        monitor.adopt(parse_model(change.model, f"{session.path}: the model promoted"))
    except RigwatchError as error:
        return [Event("replay", change.t_ns, "error", "MODEL REFUSED", str(error))]
    return []


def replay(
    session: Session,
    monitor: RigMonitor,
    span: tuple[int | None, int | None] = (None, None),
    *,
    speed: float = 0.0,
    out: Path | None = None,
    say: Callable[[Alarm], None] = lambda _: None,
) -> Replay:
    """Run `monitor` over the session.

    Args:
        session: the recording.
        monitor: new, or in the state that an earlier part left.
        span: start and end of the part to replay [ns].
        speed: multiple of real time; 0 for as fast as possible.
        out: session file for samples, estimates and alarms.
        say: called with each alarm.

    Raises:
        SessionError: the samples lack a channel, or `out` cannot be written.
    """
    done, began = Replay(), time.perf_counter()
    rate = session.info.sample_rate_hz
    size = max(1, int(PACED_BLOCK * speed * rate)) if speed > 0 else JUDGED_SAMPLES
    found = _paced(items(session, *span, size), speed)
    with _sink(session, out) as write:
        for judged in judge(session, monitor, found):
            done.count(judged)
            write(judged)
            for announcement in judged.announced:
                if isinstance(announcement, Alarm):
                    say(announcement)
    done.elapsed_s = time.perf_counter() - began
    done.lost = session.lost
    return done


def _paced(found: Iterator[Item], speed: float) -> Iterator[Item]:
    """The items, each delayed until its last sample would have arrived."""
    began, first = time.monotonic(), None
    for item in found:
        if speed > 0 and isinstance(item, SampleBlock):
            first = int(item.t_ns[0]) if first is None else first
            due = began + (int(item.t_ns[-1]) - first) / 1e9 / speed
            time.sleep(max(0.0, due - time.monotonic()))
        yield item


@contextmanager
def _sink(session: Session, out: Path | None) -> Iterator[Callable[[Judged], None]]:
    """Writes what was judged to a new session file, or nowhere."""
    if out is None:
        yield lambda _: None
        return
    notes = f"replayed from {session.path.name}"
    run = session.info
    run = replace(run, notes=f"{run.notes}; {notes}" if run.notes else notes)
    with new_file(out) as part, SessionWriter(part, run, sync=False) as writer:
        yield partial(_write, writer)


def _write(writer: SessionWriter, judged: Judged) -> None:
    writer.write(judged.item)
    if judged.watched is not None:
        writer.write(judged.watched.estimates)
    for announcement in judged.announced:
        writer.write(announcement)
