"""The recorded topics of a rig of many, whose blocks are read for all of them at once.

joined messages ─▶ row of each rig (`rigwatch.wire.rows`) ─▶ what has come since the last turn
               └▶ what does not simply follow ─▶ the rig's reader; its row is closed meanwhile
"""

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

from rigwatch.recorder.feed import Feed
from rigwatch.recorder.positions import Positions
from rigwatch.wire.bus import Bus, CompleteSubscription, JointReceiver, Subscription
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import ESTIMATES, HEALTH, Block, EstimateBlock, Message
from rigwatch.wire.rows import (
    OF_ESTIMATES,
    OF_SAMPLES,
    Gathered,
    GatheredRows,
    Kind,
    compile_gathering,
)

QUIET = 0.5
"""Time without a block after which a rig's reader looks for what is missing [s]."""


class Rows:
    """The rows of a process: those of each receiver of joined blocks.

    Args:
        count: rigs of the process.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._lock = threading.Lock()
        compile_gathering()  # before the first message arrives

    def of(self, joint: JointReceiver, kind: Kind) -> GatheredRows:
        """Those of a receiver."""
        with self._lock:
            if not isinstance(joint.rows, GatheredRows):
                joint.rows = GatheredRows(self._count, kind)
            return joint.rows


class RowFeed(Feed):
    """The recorded topics of a rig of many.

    Args:
        rows: of the process.
        number: of the rig in it.
        bus, resume_after, positions, catch_up: see `Feed`.
    """

    def __init__(
        self,
        rows: Rows,
        number: int,
        bus: Bus,
        resume_after: tuple[int, int] | None,
        positions: Positions | None,
        *,
        catch_up: float,
    ) -> None:
        super().__init__(bus, resume_after, positions, catch_up=catch_up)
        estimates = self._numbered[ESTIMATES.name]
        place = rows, number, bus.rig
        self._sample_row = _SampleRow(place, self._reader, super()._samples)
        self._estimate_row = _EstimateRow(place, estimates, partial(super()._drained, estimates))

    def _samples(self) -> list[Message]:
        return self._sample_row.take()

    def _drained(self, subscription: Subscription) -> list[Message]:
        if subscription.topic is ESTIMATES:
            return self._estimate_row.take()
        if subscription.topic is HEALTH and not subscription.may_hold():
            return []
        return super()._drained(subscription)


class _Reader(Protocol):
    """Reads what a row leaves."""

    @property
    def joint(self) -> JointReceiver | None:
        """Receives it among that of others; None if nothing does."""

    def may_hold(self) -> bool:
        """Whether something may have come."""

    def close_row(self) -> None:
        """Read all that comes here again."""


class _Row:
    """One topic of a rig.

    Args:
        place: rows of the process, number of the rig in it, and its id.
        reader: of what the row leaves.
        read: reads there.
    """

    kind: Kind

    def __init__(
        self, place: tuple[Rows, int, str], reader: _Reader, read: Callable[[], list[Message]]
    ) -> None:
        rows, self._number, rig = place
        self._reader, self._read = reader, read
        joint = reader.joint
        self._rows = None if joint is None else rows.of(joint, self.kind)
        if joint is None or not joint.name(self._number, rig):
            self._rows = None

    def take(self) -> list[Message]:
        """What has come since the last call, in order."""
        if self._rows is None:
            return self._read()
        found = list[Message]()
        if self._rows.is_open(self._number) and not self._reader.may_hold():
            taken = self._rows.taken(self._number)
            found += self._told(taken)
            if found or time.monotonic() - taken.heard_at < QUIET:
                return found
        self._reader.close_row()
        found += self._told(self._rows.taken(self._number))
        found += self._read()
        self._open(found)
        return found

    def _told(self, taken: Gathered) -> list[Block]:
        """What the row has taken, once its reader has been told."""
        raise NotImplementedError

    def _open(self, found: list[Message]) -> None:
        """Leave what follows to the row, if it can have one."""
        raise NotImplementedError


class _SampleRow(_Row):
    kind = OF_SAMPLES
    _reader: SampleReader

    def _told(self, taken: Gathered) -> list[Block]:
        if taken.blocks:
            count, t_ns = sum(map(len, taken.blocks)), int(taken.blocks[-1].t_ns[-1])
            self._reader.went_on(count, taken.heard_at, t_ns)
        return taken.blocks

    def _open(self, _found: list[Message]) -> None:
        self._reader.open_row(lambda _: True)


class _EstimateRow(_Row):
    kind = OF_ESTIMATES
    _reader: CompleteSubscription
    _last: EstimateBlock | None = None

    def _told(self, taken: Gathered) -> list[Block]:
        self._reader.went_on(taken.messages)
        return taken.blocks

    def _open(self, found: list[Message]) -> None:
        blocks = [each for each in found if isinstance(each, EstimateBlock)]
        self._last = blocks[-1] if blocks else self._last
        if self._last is not None:
            end = self._last.seq + len(self._last)
            self._reader.open_row(self._last.device, self._last.boot, end)
