"""The rigs of one receiver of joined samples, in arrays with a row for each."""

import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from monitor.pipeline import (
    PUBLISHED_NAMES,
    ColumnBytes,
    Outputs,
    RowOutputs,
    SampleRows,
    SteadyRows,
    places_of,
)
from monitor.process.cursor import Cursor
from monitor.process.handover import Passed
from monitor.process.loop import MonitorProcess
from monitor.process.rig_time import APART_NS
from monitor.process.table.kept_rows import KeptRows
from rigwatch.wire.arrays import BoolArray
from rigwatch.wire.bus import (
    Joining,
    JointReceiver,
    MessageRing,
)
from rigwatch.wire.host import both_clocks
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.messages import (
    ESTIMATES,
    Form,
    Names,
    SampleBlock,
    decode,
)
from rigwatch.wire.rows import (
    MOST_COLUMNS,
    MOST_SAMPLES,
    Batch,
    Blocks,
    EstimateRows,
    JointRows,
)

CONNECTED_FOR = 0.05
"""Time for which a router that was there is not asked for again [s]."""
LATENCIES = 256
"""Blocks of a row whose latencies are kept: more than come from one health message to the next."""
_MARK = 16
"""Bytes of a message's mark, which stands before it among others."""


@dataclass(eq=False)
class Row:
    """A rig in the table.

    Attributes:
        process: its own objects.
        device, boot: of its samples.
        state: of its stages.
        sending, ring: where its estimates go.
        names: of the channels of its blocks, once one has been read.
    """

    process: MonitorProcess
    device: str
    boot: int
    state: KeptState
    sending: Joining
    ring: MessageRing
    names: Names = ()


@dataclass(frozen=True, eq=False)
class Left:
    """A block that a row has taken and cannot finish: its rig has to leave, and goes on with it.

    Attributes:
        number: of the rig.
        block: to be judged.
        outputs: of the kernel, if it has judged the block.
    """

    number: int
    block: SampleBlock
    outputs: Outputs | None = None


class Table:
    """The rows of one receiver.

    Args:
        count: rigs of the process.
        joint: receives their samples.
    """

    def __init__(self, count: int, joint: JointReceiver) -> None:
        self._joint, self._reading = joint, JointRows(count)
        joint.rows = self._reading
        self._steady = SteadyRows(count, MOST_COLUMNS)
        self._estimates = EstimateRows(count, PUBLISHED_NAMES, MOST_SAMPLES)
        self._kept = KeptRows(count)
        self._rows: list[Row | None] = [None] * count
        self._sources: list[tuple[str, int, Names]] = [("", 0, ())] * count
        self._there = np.zeros(count, np.bool_)
        self._read, self._judged, self._end = np.zeros((3, count), np.int64)
        self._read_ns, self._judged_ns, self._offset_ns = np.zeros((3, count), np.int64)
        self._heard_at = np.zeros(count)
        self._latency_ms = np.zeros((count, LATENCIES))
        self._latencies = np.zeros(count, np.int64)
        self._moved: set[int] = set()
        self._failures: list[tuple[int, Exception]] = []
        self._look_at = np.zeros(count)
        self._connected_until = 0.0

    @property
    def unsettled(self) -> int:
        """Samples that were read and of which their rigs have not been told."""
        return int(self._read.sum())

    def enter(self, number: int, process: MonitorProcess, look_at: float) -> bool:
        """Take a rig whose samples simply follow; False if it is to go on by itself.

        Args:
            number: of the rig in its process.
            process: it has judged all that it has read.
            look_at: monotonic time of the next look at it [s].
        """
        sends = process.bus.joining(ESTIMATES) if process.is_quiet else None
        if sends is None or not self._joint.name(number, process.bus.rig):
            return False
        found = process.open_row(lambda form: self._suits(number, form))
        if found is None:
            return False
        row = Row(process, found.device, found.boot, found.state, *sends)
        source = found.device, found.boot
        if not self._estimates.begin(number, process.bus.rig, source, row.ring.place):
            process.reader.close_row()
            return False
        before, self._sources[number] = self._sources[number], (*source, row.names)
        if before[:2] == source and before[2] and not self._begin(number, row, before[2]):
            process.reader.close_row()
            return False
        self._rows[number], self._there[number] = row, True
        self._end[number], self._offset_ns[number] = found.following, found.offset_ns
        self._heard_at[number] = time.monotonic() - process.reader.silent_for()
        self._look_at[number] = look_at
        return True

    def _suits(self, number: int, form: Form) -> bool:
        """Whether the first block of a length that a row meets can be judged in it."""
        row = self._rows[number]
        if row is None:
            return False
        return form.names == row.names if row.names else self._begin(number, row, form.names)

    def _begin(self, number: int, row: Row, names: Names) -> bool:
        """Prepare a row for blocks of these channels; False if it cannot judge them."""
        channels = row.process.rig.model.channels
        places = places_of(tuple([name for name, _, _ in names]), channels)
        if places is None or not self._steady.enter(number, row.state, places, len(names)):
            return False
        self._kept.enter(number, len(names), row.process.loose_samples)
        row.names = names
        self._sources[number] = row.device, row.boot, names
        return True

    def leave(self, number: int) -> None:
        """Tell a rig what its row has done; it goes on by itself."""
        row = self._rows[number]
        if row is None:
            return
        row.process.reader.close_row()
        self._give_kept(number)
        self._rows[number], self._there[number] = None, False
        self._moved.discard(number)
        self._steady.leave(number)
        self._settle(number, row)

    def _settle(self, number: int, row: Row) -> None:
        """Tell a rig what its row has done since it was last told; all that it took is judged."""
        read, judged = int(self._read[number]), int(self._judged[number])
        self._read[number] = self._judged[number] = 0
        if read:
            heard_at, t_ns = float(self._heard_at[number]), int(self._read_ns[number])
            row.process.reader.went_on(read, heard_at, t_ns)
        if judged:
            row.process.went_on(self._passed(number, row, judged))

    def _passed(self, number: int, row: Row, judged: int) -> Passed:
        end, count = int(self._end[number]), int(self._latencies[number])
        self._latencies[number] = 0
        return Passed(
            judged,
            row.boot,
            end,
            int(self._judged_ns[number]),
            int(self._offset_ns[number]),
            self._latency_ms[number, :count].tolist(),
        )

    def close(self, number: int) -> int:
        """Forget a rig that has failed, and what its row has done; the samples that it has read."""
        read = int(self._read[number])
        if (row := self._rows[number]) is not None:
            row.process.reader.close_row()
        self._rows[number], self._there[number] = None, False
        self._read[number] = self._judged[number] = self._latencies[number] = 0
        self._moved.discard(number)
        return read

    def failures(self) -> list[tuple[int, Exception]]:
        """Rigs that have failed since the last call, and why."""
        found, self._failures = self._failures, []
        return found

    # ---- what has come ------------------------------------------------------------------

    def judge(self) -> list[Left]:
        """Judge what the rows have taken, and publish it; the blocks that are left to their rigs.

        After a block of a rig that is left so are those that follow, in their order.
        """
        batches = self._reading.taken()
        heard_at = time.monotonic()
        for batch in batches:
            there = self._there[batch.rows]  # the others have failed since
            rows, samples = batch.rows[there], batch.samples[there]
            self._read[rows] += samples
            self._read_ns[rows] = batch.t_ns[batch.at[there] + samples - 1]
            self._heard_at[rows] = heard_at
        left: list[Left] = []
        for batch in batches:
            left += self._judge_one(batch, {one.number for one in left})
        return left

    def _judge_one(self, batch: Batch, gone: set[int]) -> list[Left]:
        wanted = self._there[batch.rows]
        if gone:
            wanted &= ~np.isin(batch.rows, list(gone))
        wanted &= self._follows_time(batch)
        blocks = SampleRows(
            batch.rows,
            batch.samples,
            batch.first,
            batch.at,
            batch.values_at,
            batch.device_us,
            batch.values,
        )
        out = self._steady.judged(blocks, wanted)
        done = out.judged & ~out.holds
        self._publish(batch, out, done)
        self._account(batch, done)
        full = self._kept.keep(blocks, batch.t_ns, out.columns, done)
        for number in full:
            self._give_kept(number)
        return [] if done.all() else self._left(batch, blocks, out, np.flatnonzero(~done).tolist())

    def _left(
        self, batch: Batch, blocks: SampleRows, out: RowOutputs, places: Sequence[int]
    ) -> list[Left]:
        found = []
        for place in places:
            number = int(batch.rows[place])
            if self._rows[number] is None:
                continue  # it has failed
            outputs = self._steady.outputs_of(blocks, out, place) if out.judged[place] else None
            found.append(Left(number, decode(SampleBlock, batch.payload(place)), outputs))
        return found

    def _follows_time(self, batch: Batch) -> BoolArray:
        """Where clocks go on as `RigTime` expects: the rest is for it to decide."""
        wall_ns, monotonic_ns = both_clocks()
        offset = wall_ns - monotonic_ns
        ahead = batch.t_ns[batch.at + batch.samples - 1] - wall_ns
        follows: BoolArray = (self._offset_ns[batch.rows] - offset <= APART_NS) & (
            ahead <= APART_NS
        )
        self._offset_ns[batch.rows[follows]] = offset
        return follows

    def _publish(self, batch: Batch, out: RowOutputs, done: BoolArray) -> None:
        if not done.any():
            return
        whole = done.all()
        rows, samples, first, at = (
            one if whole else one[done]
            for one in (batch.rows, batch.samples, batch.first, batch.at)
        )
        columns = ColumnBytes(out, at)
        messages, places = self._estimates.written(
            Blocks(
                rows, samples, first, at, batch.t_ns.view(np.uint8), columns.data, columns.starts
            )
        )
        for number, (message, begin, end) in zip(rows.tolist(), places.tolist(), strict=True):
            row = self._rows[number]
            assert row is not None
            payload = messages[message][begin:end]
            row.ring.keep(payload)
            if row.sending.is_followed:
                row.sending.put_own(payload, messages[message][begin - _MARK : begin])
        if row.sending.is_heard:
            for joined in messages:
                row.sending.add_joined(joined)

    def _account(self, batch: Batch, done: BoolArray) -> None:
        """Note what has been judged of each row."""
        rows, samples = batch.rows[done], batch.samples[done]
        t_ns = batch.t_ns[batch.at[done] + samples - 1]
        self._judged[rows] += samples
        self._end[rows] += samples
        self._judged_ns[rows] = t_ns
        places = np.minimum(self._latencies[rows], LATENCIES - 1)
        self._latency_ms[rows, places] = (time.time_ns() - t_ns) / 1e6
        self._latencies[rows] = places + 1
        self._moved.update(rows.tolist())

    def _give_kept(self, number: int) -> None:
        row = self._rows[number]
        if row is None:
            return
        source = row.device, row.boot, int(self._end[number])
        if found := self._kept.taken(number, source, row.names):
            try:
                row.process.keep_for_ranking(*found)
            except Exception as error:  # of one rig: the others go on
                self._failures.append((number, error))

    # ---- after the turn, and in between -------------------------------------------------

    def keep_positions(self) -> None:
        """Store the positions of the rigs whose samples have been judged."""
        moved, self._moved = self._moved, set()
        positions = []
        for number in moved:
            row = self._rows[number]
            if row is not None and row.process.cursor is not None:
                positions.append((row.process.cursor, row.boot, int(self._end[number]) - 1))
        Cursor.write_all(positions)

    def restless(self, now: float, look_every: float, left: Collection[int] = ()) -> list[int]:
        """The rigs that have to leave: something has closed their rows, or is to be looked at.

        Args:
            now: monotonic time [s].
            look_every: time from one look at a rig to the next [s].
            left: rigs that leave in any case, of which not all that was taken is judged.
        """
        there = self._there.copy()
        there[[*left]] = False
        found: list[int] = np.flatnonzero(there & ~self._reading.state.open).tolist()
        due = np.flatnonzero(there & self._reading.state.open & (self._look_at <= now))
        if due.size:
            # All in the same turns: what a look needs is then at hand.
            self._look_at[due] = look_every * (now // look_every + 1)
            connected = self._is_connected(now)
            silent = (now - self._heard_at[due]).tolist()
            for number, silent_s in zip(due.tolist(), silent, strict=True):
                row = self._rows[number]
                if row is not None and not (connected and self._goes_on(number, row, silent_s)):
                    self._look_at[number] = now
                    found.append(number)
        return found

    def look_at(self, number: int) -> float:
        """Monotonic time of the next look at a rig [s]."""
        return float(self._look_at[number])

    def _goes_on(self, number: int, row: Row, silent_s: float) -> bool:
        """Whether a rig that is looked at may stay; its health is told from here."""
        try:
            if not row.process.is_calm(silent_s):
                return False
            if not row.process.health_is_due:
                return True
            self._settle(number, row)
            return row.process.tell_health()
        except Exception as error:  # of one rig: the others go on
            self._failures.append((number, error))
            return True

    def _is_connected(self, now: float) -> bool:
        """Whether the router is there, which is the same for all: asked now and then."""
        if now >= self._connected_until:
            there = next(row for row in self._rows if row is not None)
            connected = there.process.bus.connected()
            self._connected_until = now + CONNECTED_FOR if connected else now
            return connected
        return True


class Tables:
    """The tables of a process: one for each receiver of its rigs' samples.

    Args:
        count: rigs of the process.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._tables: dict[int, Table] = {}
        self._joints: list[JointReceiver] = []

    def of(self, joint: JointReceiver) -> Table:
        """The table of a receiver."""
        if id(joint) not in self._tables:
            self._joints.append(joint)
            self._tables[id(joint)] = Table(self._count, joint)
        return self._tables[id(joint)]

    def __iter__(self) -> Iterator[Table]:
        return iter(tuple(self._tables.values()))

    @property
    def unsettled(self) -> int:
        """Samples that were read and of which their rigs have not been told."""
        return sum(table.unsettled for table in self)
