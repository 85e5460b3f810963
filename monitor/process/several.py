"""Several rigs in one process: they take turns, and none waits for another.

    rigs ──turn──▶ every sample that has come since ─▶ judged together ─▶ estimates, alarms

Most of the cost of a sample is that of a call, and results do not depend on how samples are divided
into blocks: the samples of a turn are judged as one block. A turn is short, since daq has already
waited for a block; a rig of which nothing came costs a look at its queue. Under load turns get
longer, blocks with them, and a sample costs less. A rig joins when its files are right and its
router answers; one that fails is left alone for a while and starts anew, as its process would.
"""

import contextlib
import logging
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Container, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from monitor.model import RigModel
from monitor.pipeline import Finish, Ready, completed, judge_together
from monitor.process.loop import (
    LONGEST_BLOCK,
    MonitorProcess,
    prepared,
)
from monitor.process.table import Left, Table, Tables, compile_table
from rigwatch.wire.bus import Bus, SharedLinks, connect
from rigwatch.wire.delivery import Item
from rigwatch.wire.errors import RigwatchError, line_about
from rigwatch.wire.host import (
    MONITOR,
    NO_ROUTER,
    Heartbeat,
    prepare_for_real_time,
    raise_priority,
    set_at_signal,
    tidy_memory,
    unless_ended,
    waits_of,
)
from rigwatch.wire.messages import SampleBlock, pieces
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.several_rigs import Rigs, check_own, valid_rigs

TURN = 0.005
"""Time from one turn to the next: samples wait for half of it on average [s]."""
LOOK_EVERY = 0.1
"""Time from one look at a rig's commands, link and silence to the next [s]."""
MOST_BLOCKS = 4
"""Blocks of one rig in a turn while it catches up, so that the others go on."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Pauses before a rig that failed starts anew [s]."""
Say = Callable[[str], None]
_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Joined:
    """A rig whose files are right and whose router has answered."""

    config: RigConfig
    model: RigModel
    bus: Bus


class Seat:
    """One rig of the process: joined, or waiting for its router or for another attempt.

    Each attempt reads the rig's files anew, so that a mistake that was corrected ends.

    Args:
        path: its configuration.
        say: called with remarks for people.
        join: connects to the rig's bus, and waits for its router.
    """

    def __init__(
        self, path: Path, say: Say, join: Callable[[RigConfig, str], Bus] = connect
    ) -> None:
        self._path, self._say, self._join = path, say, join
        self._process: MonitorProcess | None = None
        self._due: deque[Item] = deque()
        self._ready: Ready | None = None
        self._joined: queue.SimpleQueue[Joined] = queue.SimpleQueue()
        self._pause, self._again_at = FIRST_PAUSE, float("inf")
        self._before = 0
        self._settled = False
        self._look_at = 0.0
        self._table: Table | None = None
        self._number, self._has_looked = 0, False
        self._connect()

    @property
    def is_running(self) -> bool:
        """Whether the rig is watched now."""
        return self._process is not None

    @property
    def delivered(self) -> int:
        """Samples read so far, by all runs of the rig."""
        now = self._process.reader.counters.delivered if self._process else 0
        return self._before + now

    @property
    def waits(self) -> str:
        """Why there are no samples to come: no bus yet, no daq, or no device; else empty."""
        if self._table is not None:
            return ""
        return NO_ROUTER if self._process is None else self._process.waits()

    @property
    def is_in_table(self) -> bool:
        """Whether a row does for now what is to be done."""
        return self._table is not None

    def enter(self, tables: Tables, number: int) -> None:
        """Leave to a row what simply follows, if there is nothing else; a failure as in `read`.

        That is after a look around: a rig that leaves its row with every block does not come back
        with every block.
        """
        looked, self._has_looked = self._has_looked, False
        if looked and self._process is not None and not self._due:
            self._number = number
            self._alone(partial(self._enter_table, tables), self._process)

    def _enter_table(self, tables: Tables, process: MonitorProcess) -> None:
        if (joint := process.reader.joint) is not None:
            table = tables.of(joint)
            if table.enter(self._number, process, self._look_at):
                self._table = table

    def leave_table(self) -> None:
        """Go on by itself; a failure as in `read`."""
        table, self._table = self._table, None
        if table is not None and self._process is not None:
            self._look_at = table.look_at(self._number)
            self._alone(lambda _: table.leave(self._number), self._process)

    def see_to(self, left: Left) -> None:
        """Go on with a block that a row has taken; a failure as in `read`."""
        process, outputs = self._process, left.outputs
        if process is None:
            return
        if outputs is None:
            self._due.append(left.block)
            return
        self._settled = True
        judged = partial(completed, process.rig, left.block, outputs)
        self._alone(lambda process: process.take_judged(left.block, judged()), process)

    def has_work(self, now: float) -> bool:
        """Whether something has come, is to be judged, or is due at monotonic time `now` [s];
        a failure as in `read`.
        """
        process = self._process
        if process is None:
            return self.may_start(now)
        if self._due or now >= self._look_at:
            return True
        try:
            return process.reader.may_hold()
        except Exception as error:  # as in `_alone`
            self.fail(error)
            return False

    def may_start(self, now: float) -> bool:
        """Whether it does not run, and its router has answered or another attempt is due."""
        return self._process is None and (not self._joined.empty() or now >= self._again_at)

    def read(self) -> None:
        """Take what has come; a failure ends this rig's run and no other's."""
        if self._process is None:
            self._start()
        else:
            self._alone(self._read, self._process)

    def judge(self) -> None:
        """Judge what was taken; a failure as in `read`."""
        if self._process is not None:
            self._alone(self._judge, self._process)

    def _alone(self, work: Callable[[MonitorProcess], None], process: MonitorProcess) -> None:
        try:
            work(process)
        except Exception as error:  # whatever is wrong with one rig, the others are watched
            self.fail(error)

    def _read(self, process: MonitorProcess) -> None:
        if not self._due:
            self._due.extend(_divided(process.reader.read(0.0)))

    def _judge(self, process: MonitorProcess) -> None:
        now = time.monotonic()
        if not self._due and now < self._look_at:
            return
        for _ in range(min(MOST_BLOCKS, len(self._due))):
            process.take(self._due.popleft())
        self._settled = not self._due  # all that was read has been judged
        if self._settled and now >= self._look_at:
            process.look_around()
            self._look_at, self._pause = now + LOOK_EVERY, FIRST_PAUSE
            self._has_looked = True

    def ready(self) -> Ready | None:
        """The next block, if it can be judged together with those of other rigs."""
        self._ready = None
        if self._process is not None and self._due:
            self._alone(self._look, self._process)
        return self._ready

    def _look(self, process: MonitorProcess) -> None:
        self._ready = process.ready(self._due[0])

    def finish(self, judged: Finish) -> None:
        """Publish the results of the block that was ready; a failure as in `read`."""
        process, ready = self._process, self._ready
        if process is None or ready is None:
            return
        self._due.popleft()
        self._settled = not self._due
        self._alone(lambda process: process.take_judged(ready.block, judged()), process)

    def keep_position(self) -> None:
        """Store the position once the turn's estimates have been sent: a kill loses none."""
        if self._settled and self._process is not None:
            self._process.keep_position()
        self._settled = False

    def _connect(self) -> None:
        """Read the rig's files and wait for its router in a thread: it may never answer."""
        call = threading.Thread(target=self._enter, daemon=True)
        call.start()

    def _enter(self) -> None:
        try:
            config = load_rig(self._path)
            model = prepared(config, self._path)
            self._joined.put(Joined(config, model, self._join(config, "monitor")))
        except Exception as error:  # said, and tried again, in the loop's thread
            self._say(line_about(self._path, error))
            self._again_at = time.monotonic() + LONGEST_PAUSE

    def _start(self) -> None:
        if not self._joined.empty():
            rig = self._joined.get()
            try:
                self._process = MonitorProcess(rig.config, self._path, rig.model, rig.bus)
            except Exception as error:  # as in `turn`
                rig.bus.close()
                self._wait(error)
        elif time.monotonic() >= self._again_at:
            self._again_at = float("inf")
            self._connect()

    def fail(self, error: Exception) -> None:
        """End this run of the rig; it starts anew after a pause."""
        self._before = self.delivered
        self.close()
        self._wait(error)

    def _wait(self, error: Exception) -> None:
        self._say(f"{line_about(self._path, error)}; starts anew in {self._pause:.0f} s")
        self._again_at = time.monotonic() + self._pause
        self._pause = min(2 * self._pause, LONGEST_PAUSE)

    def close(self) -> None:
        """Leave the rig's bus."""
        process, self._process = self._process, None
        table, self._table = self._table, None
        if table is not None:
            self._before += table.close(self._number)
        self._due.clear()
        if process is None:
            return
        try:
            process.close()
        except Exception as error:  # the bus is left in any case
            self._say(line_about(self._path, error))
        finally:
            process.bus.close()


def _nothing() -> None:
    """Where each rig gets its messages on their own."""


def _divided(items: Iterable[Item]) -> Iterable[Item]:
    for item in items:
        if isinstance(item, SampleBlock):
            yield from pieces(item, LONGEST_BLOCK)
        else:
            yield item


def one_turn(
    seats: Sequence[Seat],
    together: Callable[[], AbstractContextManager[object]],
    collect: Callable[[], None] = _nothing,
    tables: Tables | None = None,
) -> None:
    """Judge what has come of all rigs, send it, and only then store the positions.

    All are read before any is judged: a block of one that is judged late is as old as the others'.

    Args:
        seats: the rigs.
        together: entered for the turn, so that what it sends leaves together.
        collect: hands each rig what has come for several.
        tables: do what simply follows; None for nothing.
    """
    collect()
    with together():
        left = set() if tables is None else _judge_rows(seats, tables)
        busy = _busy(seats, left)
        rigs = [seat for _, seat in busy]
        for seat in rigs:
            seat.read()
        _judge_first(rigs)
        for seat in rigs:
            seat.judge()
    for _, seat in busy:
        seat.keep_position()
    if tables is not None:
        _keep_rows(seats, busy, tables)


def _busy(seats: Sequence[Seat], left: Container[int]) -> list[tuple[int, Seat]]:
    """The rigs that have something to do themselves, each with its number.

    Of those that start only one: to begin takes as long as hundreds of blocks of the others.

    Args:
        seats: the rigs.
        left: those that have just left their tables.
    """
    now, starts = time.monotonic(), False
    found = []
    for number, seat in enumerate(seats):
        if seat.is_in_table or not (seat.has_work(now) or number in left):
            continue
        if not seat.is_running:
            if starts:
                continue
            starts = True
        found.append((number, seat))
    return found


def _judge_rows(seats: Sequence[Seat], tables: Tables) -> set[int]:
    """Judge what rows have taken; the rigs that have left their tables."""
    gone: set[int] = set()
    for table in tables:
        left = table.judge()
        alone = {one.number for one in left}
        alone.update(table.restless(time.monotonic(), LOOK_EVERY, alone))
        for number in alone:
            seats[number].leave_table()
        for one in left:
            seats[one.number].see_to(one)
        gone |= alone
    return gone


def _keep_rows(seats: Sequence[Seat], busy: Iterable[tuple[int, Seat]], tables: Tables) -> None:
    """Store the positions of the rows, end the rigs that have failed there, let others enter."""
    for table in tables:
        table.keep_positions()
        for number, error in table.failures():
            seats[number].fail(error)
    for number, seat in busy:
        seat.enter(tables, number)


def _judge_first(seats: Iterable[Seat]) -> None:
    """Judge the first blocks of all rigs together where they simply follow the last ones."""
    found = [(seat, ready) for seat in seats if (ready := seat.ready()) is not None]
    finishes = judge_together([ready for _, ready in found])
    for (seat, _), finish in zip(found, finishes, strict=True):
        if finish is not None:
            seat.finish(finish)


def take_turns(
    seats: list[Seat],
    stop: threading.Event,
    heartbeat: Heartbeat,
    together: Callable[[], AbstractContextManager[object]] = contextlib.nullcontext,
    collect: Callable[[], None] = _nothing,
    *,
    tables: Tables | None = None,
) -> None:
    """The loop over all rigs until `stop` is set.

    Args:
        seats: the rigs.
        stop: ends the loop.
        heartbeat: of the process.
        together, collect, tables: for each turn, see `one_turn`.
    """
    tell_at = 0.0
    while not stop.is_set():
        began = time.monotonic()
        one_turn(seats, together, collect, tables)
        if began >= tell_at:
            tell_at = began + LOOK_EVERY
            waits = waits_of(seat.waits for seat in seats)
            in_rows = 0 if tables is None else tables.unsettled
            heartbeat.advance(sum(seat.delivered for seat in seats) + in_rows, waits)
        stop.wait(max(0.0, began + TURN - time.monotonic()))


def run_several(paths: list[Path]) -> int:
    """Monitor the rigs at `paths` until a signal ends it; the exit code.

    Raises:
        RigwatchError: no configuration is valid, or two are of one rig or one journal.
    """
    stop = set_at_signal()
    loaded = valid_rigs(paths)  # a wrong file is named by its rig's seat
    check_own("monitor.journal", _journals(loaded))
    unless_ended(stop, lambda: _prepare(loaded))
    raise_priority(MONITOR)
    heartbeat = Heartbeat("monitor")
    prepare_for_real_time()
    tidy_memory(stop)
    links = SharedLinks(len(paths))
    seats = [Seat(path, _log.warning, partial(connect, links=links)) for path in paths]
    heartbeat.ready()
    tables = Tables(len(seats))
    take_turns(seats, stop, heartbeat, links.together, links.collect, tables=tables)
    heartbeat.stopping()
    for seat in seats:
        seat.close()
    links.close()
    return 0


def _prepare(loaded: Rigs) -> None:
    """Compile what the rigs need before any is watched; a seat says what is wrong with its rig."""
    known: set[str] = set()
    for path, config in loaded:
        with contextlib.suppress(RigwatchError):
            compile_table(prepared(config, path), known)


def _journals(loaded: Rigs) -> Iterable[tuple[Path, str]]:
    for path, config in loaded:
        if config.monitor and config.monitor.journal:
            yield path, str(Path(config.monitor.journal).resolve())
