"""A recorded session as the monitor received it: samples in order, commands between them.

A command takes effect between two samples, so its position does not depend on how the samples
were cut into blocks.
"""

from collections.abc import Iterator

from rigwatch.replay.orders import Order, WaitingOrders, orders_of
from rigwatch.wire.messages import SampleBlock, cut, pieces
from rigwatch.wire.session import Session

Item = SampleBlock | Order
JUDGED_SAMPLES = 4088
"""Longest block that is judged at once: results of longer ones do not fit into a core's cache, and
with a power of two all results of a sample would share the same few places of it.
"""


def items(
    session: Session,
    start: int | None = None,
    end: int | None = None,
    size: int = JUDGED_SAMPLES,
    device: str | None = None,
) -> Iterator[Item]:
    """Samples in blocks of at most `size`, with commands and model changes between them."""
    waiting = WaitingOrders(orders_of(session, start, end))
    for whole in session.samples(device, start, end):
        for block in pieces(whole, size):
            yield from _interleaved(block, waiting)
    yield from waiting.rest()


def _interleaved(block: SampleBlock, waiting: WaitingOrders) -> Iterator[Item]:
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
