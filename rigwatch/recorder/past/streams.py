"""Samples or estimates in order, with those that the ring no longer had filled in from a recording.

    blocks, gaps ──▶ BlockStream ──▶ blocks in order; gaps that no recording fills
                        │ Hole ▲
                        ▼      └── blocks of the recording

From the first gap on all blocks wait until the recording has answered. The samples received so far
are known, so that none is delivered twice, whatever the answer repeats.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rigwatch.wire.messages import Block, Gap, Message, Streams, cut, unseen
from rigwatch.wire.session import Span, without


@dataclass(frozen=True, slots=True)
class Hole:
    """The span in which messages are missing, both ends included [ns]."""

    start: int
    end: int


class BlockStream:
    """The blocks of one topic, whose gaps are filled from a recording.

    Args:
        last: the last block that an earlier run has recorded; None if there is none.

    Attributes:
        hole: the hole that is being filled; None if there is none.
        filled: samples put in from recordings so far.
        reached: time up to which the hole has been filled [ns].
    """

    def __init__(self, last: Block | None = None) -> None:
        self.hole: Hole | None = None
        self.filled = 0
        self.reached = 0
        self._following = Streams()
        self._last: Block | None = None
        self._held: list[Message] = []
        self._filled_spans: dict[int, list[Span]] = {}
        if last is not None:
            self._note(last)

    @property
    def holds(self) -> bool:
        """Whether messages wait behind a gap."""
        return bool(self._held)

    @property
    def share(self) -> float:
        """How much of the hole has been filled, 0 to 1; 1 if there is none."""
        if self.hole is None or self.hole.end <= self.hole.start:
            return 1.0
        return (self.reached - self.hole.start) / (self.hole.end - self.hole.start)

    def add(self, items: Sequence[Message]) -> list[Message]:
        """Take the next messages in order; returns those that are due."""
        self._held += items
        return [] if self.hole else list(self._due())

    def fill(self, blocks: Sequence[Block]) -> list[Message]:
        """Take blocks of the recording; returns what of them is missing."""
        fresh = [part for block in blocks if (part := self._missing(block)) is not None]
        for block in fresh:
            self._note(block)
            self.filled += len(block)
            self._filled_spans.setdefault(block.boot, []).append(_span(block))
        return [*fresh]

    def end(self, *, answered: bool) -> list[Message]:
        """The answer has ended; returns what is due now, first the gaps that remain.

        Args:
            answered: whether the recording was read to its end.
        """
        gaps = [item for item in self._held[: self._gaps()] if isinstance(item, Gap)]
        remaining = [one for gap in gaps for one in self._remaining(gap, answered)]
        others = [item for item in self._held[: self._gaps()] if not isinstance(item, Gap)]
        self._held = self._held[self._gaps() :]
        self.hole, self._filled_spans = None, {}
        return [*others, *remaining, *self._due()]

    def rest(self) -> list[Message]:
        """Give up what waits: a later run begins before the gap."""
        held, self._held, self.hole = self._held, [], None
        return [item for item in held if not isinstance(item, Block | Gap)]

    def _due(self) -> Iterator[Message]:
        while self._held:
            item = self._held[0]
            if isinstance(item, Gap) and self._last is not None:
                self._open()
                return
            if isinstance(item, Block):
                self._note(item)
            yield self._held.pop(0)

    def _open(self) -> None:
        """A gap is next: it ends with the first block behind it, which may be yet to come."""
        behind = self._next()
        if behind is not None and self._last is not None:
            self.reached = int(self._last.t_ns[-1])
            self.hole = Hole(self.reached, int(behind.t_ns[0]))

    def _next(self) -> Block | None:
        """The first block that waits."""
        return next((item for item in self._held if isinstance(item, Block)), None)

    def _next_like(self, block: Block) -> Block | None:
        """The first block that waits of the same stream."""
        waiting = (item for item in self._held if isinstance(item, Block))
        return next((one for one in waiting if self._following.are_one(one, block)), None)

    def _gaps(self) -> int:
        """Number of waiting messages before the first block."""
        behind = self._next()
        return len(self._held) if behind is None else self._held.index(behind)

    def _missing(self, block: Any) -> Any:
        """The part of a recorded block that is neither here already nor behind the hole."""
        fresh, behind = unseen(block, self._following.next_seq(block)), self._next_like(block)
        if fresh is None or behind is None:
            return fresh
        count = min(len(fresh), behind.seq - fresh.seq)
        return cut(fresh, 0, count) if count > 0 else None

    def _note(self, block: Block) -> None:
        self._last = block
        self._following.note(block)
        self.reached = int(block.t_ns[-1])

    def _remaining(self, gap: Gap, answered: bool) -> list[Gap]:
        """What of a gap no recording has filled."""
        if not answered:
            return [gap]
        if gap.topic or gap.last < gap.first:
            return []  # The recording has all there was, and its own reports of what it lacks.
        filled = sorted(self._filled_spans.get(gap.boot, ()))
        spans = without([(gap.first, gap.last)], filled)
        return [replace(gap, first=first, last=last) for first, last in spans]


def _span(block: Block) -> Span:
    return block.seq, block.seq + len(block) - 1
