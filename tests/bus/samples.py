"""Sample blocks whose values can be told from their number, and what a reader made of them."""

import numpy as np

from rigwatch.wire.messages.message_types import Column, Gap, SampleBlock
from rigwatch.wire.ordering.outcomes import Loss

PERIOD_NS = 3_906_250


def block(
    seq: int, n: int = 1, boot: int = 7, start_ns: int = 0, period_ns: float = PERIOD_NS
) -> SampleBlock:
    """Samples `seq` … `seq + n - 1` of `boot`; sample k has the value k + boot / 1000."""
    numbers = np.arange(seq, seq + n)
    return SampleBlock(
        "rig",
        boot,
        seq,
        numbers * 3906,
        start_ns + (numbers * period_ns).astype(np.int64),
        (
            Column("voltage", "V", numbers + boot / 1000, np.zeros(n, np.uint8)),
            Column("position", "m", -(numbers + boot / 1000)),
        ),
    )


def is_intact(part: SampleBlock) -> bool:
    """Whether every value of a block made by `block` is still the one of its number."""
    numbers = np.arange(part.seq, part.seq + len(part)) + part.boot / 1000
    return bool(
        np.array_equal(part.channel("voltage").values, numbers)
        and np.array_equal(part.channel("position").values, -numbers)
    )


class Ledger:
    """What a reader said about each sample of each boot, in the order in which it said it.

    `spans[boot]` lists (first, last, lost) as reported; `assert_complete` fails where samples
    were reported twice, out of order or not at all.
    """

    def __init__(self) -> None:
        self.spans: dict[int, list[tuple[int, int, bool]]] = {}
        self.boots: list[int] = []
        self.unknown_ends: list[int] = []

    def add(self, item: object) -> None:
        if isinstance(item, SampleBlock):
            assert is_intact(item)
            self._span(item.boot, item.seq, item.seq + len(item) - 1, lost=False)
        elif isinstance(item, Loss | Gap):
            if item.last < item.first:
                self.unknown_ends.append(item.boot)
            else:
                self._span(item.boot, item.first, item.last, lost=True)

    def _span(self, boot: int, first: int, last: int, *, lost: bool) -> None:
        self.spans.setdefault(boot, []).append((first, last, lost))
        if not self.boots or self.boots[-1] != boot:
            self.boots.append(boot)

    def assert_complete(self, boot: int, first: int | None = None, last: int | None = None) -> None:
        spans = self.spans.get(boot, [])
        ends = [span[1] for span in spans]
        starts = [span[0] for span in spans]
        assert starts[1:] == [end + 1 for end in ends[:-1]], spans
        if first is not None:
            assert starts[:1] == [first], spans
        if last is not None:
            assert ends[-1:] == [last], spans

    def last(self, boot: int) -> int:
        return self.spans[boot][-1][1] if self.spans.get(boot) else -1

    def lost(self, boot: int) -> int:
        return sum(end - start + 1 for start, end, lost in self.spans.get(boot, []) if lost)

    def delivered(self, boot: int) -> int:
        return sum(end - start + 1 for start, end, lost in self.spans.get(boot, []) if not lost)
