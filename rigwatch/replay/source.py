"""A recorded session as the monitor received it: samples in order, commands between them.

A command takes effect between two samples, so its position does not depend on how the samples
were cut into blocks.
"""

import re
from collections import Counter
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
    waiting = _orders(session, start, end)
    for whole in session.samples(device, start, end):
        for block in pieces(whole, size):
            yield from _interleaved(block, waiting)
    yield from waiting


def _orders(session: Session, start: int | None, end: int | None) -> list[Order]:
    """The session's commands and model changes in order of time."""
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
    return sorted(_executed(found, refused), key=lambda message: message.t_ns)


def _executed(found: list[Order], refused: Counter[str]) -> list[Order]:
    """From the last, those that the monitor did not refuse; of equal ones it executed the first."""
    kept = []
    for order in reversed(found):
        if isinstance(order, AlarmCommand) and refused[mark := command_mark(order)] > 0:
            refused[mark] -= 1
        else:
            kept.append(order)
    return kept[::-1]


def _interleaved(block: SampleBlock, waiting: list[Order]) -> Iterator[Item]:
    """The block, cut at the commands, which are removed from `waiting`."""
    done = 0
    while waiting and waiting[0].t_ns <= int(block.t_ns[-1]):
        command = waiting.pop(0)
        at = max(done, int(np.searchsorted(block.t_ns, command.t_ns)))
        if at > done:
            yield cut(block, done, at)
        yield command
        done = at
    if done < len(block):
        yield cut(block, done, len(block)) if done else block
