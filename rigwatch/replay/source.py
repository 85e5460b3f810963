"""A recorded session as the monitor received it: samples in order, commands between them.

A command takes effect between two samples, so its position does not depend on how the samples
were cut into blocks.
"""

import re
from collections import Counter, deque
from collections.abc import Iterator

import numpy as np

from rigwatch.wire.bus import command_mark
from rigwatch.wire.messages import AlarmCommand, Event, ModelChange, SampleBlock, cut, pieces
from rigwatch.wire.session import Session

Order = AlarmCommand | ModelChange
Item = SampleBlock | Order
JUDGED_SAMPLES = 4088
"""Longest block that is judged at once: results of longer ones do not fit into a core's cache, and
with a power of two all results of a sample would share the same few places of it.
"""
_MARK = re.compile(r"\((command [0-9a-f]{16})\)$")


def items(
    session: Session,
    start: int | None = None,
    end: int | None = None,
    size: int = JUDGED_SAMPLES,
    device: str | None = None,
) -> Iterator[Item]:
    """Samples in blocks of at most `size`, with commands and model changes between them."""
    waiting = _Waiting(_orders(session, start, end))
    for whole in session.samples(device, start, end):
        for block in pieces(whole, size):
            yield from _interleaved(block, waiting)
    yield from waiting.rest()


class _Waiting:
    """Orders that have not been given yet: commands in order of time, changes as they were said.

    A model change tells the first sample that is judged with the new model: among those of its boot
    it falls by number, as the clock may have been set. Where its boot had no more, its time counts.
    """

    def __init__(self, orders: list[Order]) -> None:
        commands = (one for one in orders if isinstance(one, AlarmCommand))
        self._commands = deque(sorted(commands, key=lambda one: one.t_ns))
        self._changes = deque(one for one in orders if isinstance(one, ModelChange))

    def take(self, block: SampleBlock) -> tuple[int, Order] | None:
        """The first order that falls into a block, and the sample before which it comes."""
        change = command = len(block)
        if self._changes:
            change = _place(self._changes[0], block)
        if self._commands:
            command = _by_time(self._commands[0], block)
        if min(change, command) == len(block):
            return None
        if change <= command:
            return change, self._changes.popleft()
        return command, self._commands.popleft()

    def rest(self) -> list[Order]:
        """Those that fell into no block, in order of time."""
        return sorted([*self._commands, *self._changes], key=lambda one: one.t_ns)


def _place(change: ModelChange, block: SampleBlock) -> int:
    if (change.device, change.boot) == (block.device, block.boot):
        return min(max(0, change.seq - block.seq), len(block))
    return _by_time(change, block)


def _by_time(order: Order, block: SampleBlock) -> int:
    """The first sample of a block that is not earlier than an order; its length if none is."""
    return int(np.searchsorted(block.t_ns, order.t_ns))


def _orders(session: Session, start: int | None, end: int | None) -> list[Order]:
    """The session's commands and model changes, as they were recorded."""
    topics = [name for name in ("commands", "models") if session.may_hold(name)]
    if not topics:
        return []
    recorded = [item.message for item in session.messages([*topics, "events"], start, end)]
    found = [message for message in recorded if isinstance(message, Order)]
    refused = Counter(
        mark[1]
        for message in recorded
        if isinstance(message, Event) and message.code == "alarm_command_refused"
        if message.source == "monitor/alarms" and (mark := _MARK.search(message.text))
    )
    return _executed(found, refused)


def _executed(found: list[Order], refused: Counter[str]) -> list[Order]:
    """From the last, those that the monitor did not refuse; of equal ones it executed the first."""
    kept = []
    for order in reversed(found):
        if isinstance(order, AlarmCommand) and refused[mark := command_mark(order)] > 0:
            refused[mark] -= 1
        else:
            kept.append(order)
    return kept[::-1]


def _interleaved(block: SampleBlock, waiting: _Waiting) -> Iterator[Item]:
    """The block, cut at the orders that fall into it."""
    done = 0
    while (found := waiting.take(block)) is not None:
        at = max(done, found[0])
        if at > done:
            yield cut(block, done, at)
        yield found[1]
        done = at
    if done < len(block):
        yield cut(block, done, len(block)) if done else block
