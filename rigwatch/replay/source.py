"""A recorded session as the monitor met it: samples in order, operators' commands between.

A command takes effect between two samples, so that where it falls does not depend on how the
samples were cut.
"""

from collections.abc import Iterator

import numpy as np

from rigwatch.wire.blocks import cut, pieces
from rigwatch.wire.messages import AlarmCommand, SampleBlock
from rigwatch.wire.session.reader import MERGED_SAMPLES, Session

Item = SampleBlock | AlarmCommand


def items(
    session: Session,
    start: int | None = None,
    end: int | None = None,
    size: int = MERGED_SAMPLES,
    device: str | None = None,
) -> Iterator[Item]:
    """Samples in blocks of at most `size`, and the commands of the same span of time [ns]."""
    waiting = _commands(session, start, end) if session.may_hold("commands") else []
    for whole in session.samples(device, start, end):
        for block in pieces(whole, size):
            yield from _interleaved(block, waiting)
    yield from waiting


def _commands(session: Session, start: int | None, end: int | None) -> list[AlarmCommand]:
    """The session's commands in order of time; takes a pass through all of it."""
    recorded = (item.message for item in session.messages(["commands"], start, end))
    commands = [message for message in recorded if isinstance(message, AlarmCommand)]
    return sorted(commands, key=lambda command: command.t_ns)


def _interleaved(block: SampleBlock, waiting: list[AlarmCommand]) -> Iterator[Item]:
    """The block, cut where commands fall, which are taken off `waiting`."""
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
