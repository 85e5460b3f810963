"""What people ordered in a recording, and between which samples each order took effect.

Commands and model changes tell the sample behind which they fall, as the clocks of operators,
monitor and samples differ and may be set. Commands in recordings of earlier versions do not; they
fall where the samples have their time.
"""

import re
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.wire.bus import TakenAt, command_mark, taken_at
from rigwatch.wire.messages import AlarmCommand, Event, Message, ModelChange, SampleBlock
from rigwatch.wire.session import Session

Order = AlarmCommand | ModelChange
_MARK = re.compile(r"\((command [0-9a-f]{16})\)$")


@dataclass(frozen=True, slots=True)
class Placed:
    """An order, and the first sample after it where that is known by its number.

    Attributes:
        order: a command as the monitor executed it, or a change.
        boot, seq: the sample; None by its time alone.
    """

    order: Order
    boot: int | None = None
    seq: int = 0


class WaitingOrders:
    """The orders of a session that have not been given yet.

    Args:
        found: in recorded order.
    """

    def __init__(self, found: Iterable[Placed]) -> None:
        commands, changes, by_time = deque[Placed](), deque[Placed](), list[Placed]()
        for one in found:
            if isinstance(one.order, ModelChange):
                changes.append(one)
            elif one.boot is not None:
                commands.append(one)
            else:
                by_time.append(one)
        timed = deque(sorted(by_time, key=_time))
        # At one sample in this order, in which the monitor looks for them.
        self._queues = commands, changes, timed
        self._boots = set[int]()

    def take(self, block: SampleBlock) -> tuple[int, Order] | None:
        """The first order that falls into a block, and the sample before which it comes."""
        self._boots.add(block.boot)
        places = [(self._place(one[0], block), one) for one in self._queues if one]
        at, queue = min(places, key=lambda place: place[0], default=(len(block), deque()))
        return None if at == len(block) else (at, queue.popleft().order)

    def _place(self, one: Placed, block: SampleBlock) -> int:
        """The first sample of a block that comes after an order; its length if none does."""
        if one.boot == block.boot:
            return min(max(0, one.seq - block.seq), len(block))
        if one.boot in self._boots:
            return 0  # its boot has no more
        return int(np.searchsorted(block.t_ns, one.order.t_ns))

    def rest(self) -> list[Order]:
        """Those that fell into no block, in order of time."""
        left = [one for queue in self._queues for one in queue]
        return [one.order for one in sorted(left, key=_time)]


def orders_of(session: Session, start: int | None, end: int | None) -> list[Placed]:
    """The commands and model changes of a session that took effect, as they were recorded.

    Args:
        session: the recording.
        start, end: time span [start, end) [ns].
    """
    topics = [name for name in ("commands", "models") if session.may_hold(name)]
    if not topics:
        return []
    recorded = [item.message for item in session.messages([*topics, "events"], start, end)]
    events = [message for message in recorded if isinstance(message, Event)]
    places = {one.mark: one for one in map(taken_at, events) if one is not None}
    return [_placed(one, places) for one in _executed(recorded, events)]


def _placed(order: Order, places: dict[str, TakenAt]) -> Placed:
    if isinstance(order, ModelChange):
        return Placed(order, order.boot, order.seq)
    at = places.get(command_mark(order))
    if at is None:
        return Placed(order)
    return Placed(replace(order, t_ns=at.t_ns), at.boot, at.seq + 1)


def _executed(recorded: list[Message], events: list[Event]) -> list[Order]:
    """From the last, those that the monitor did not refuse; of equal ones it executed the first."""
    refused = Counter(
        found[1]
        for event in events
        if event.code == "alarm_command_refused" and event.source == "monitor/alarms"
        if (found := _MARK.search(event.text))
    )
    kept = []
    for order in reversed([one for one in recorded if isinstance(one, Order)]):
        if isinstance(order, AlarmCommand) and refused[mark := command_mark(order)] > 0:
            refused[mark] -= 1
        else:
            kept.append(order)
    return kept[::-1]


def _time(one: Placed) -> int:
    return one.order.t_ns
