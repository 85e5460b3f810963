"""What a session lacks, each sample and message counted once.

Several readers may report the same loss, and one reader's loss may be in the recording all the
same: samples are missing if reported lost or skipped between two others, and not present. The
reports of recorder, daq and monitor count: those of any other process may be made up.
"""

from bisect import bisect_left
from collections.abc import Iterable
from itertools import pairwise

from rigwatch.wire.messages import ALARMS, RECORDERS, Gap, SampleBlock, is_source

Span = tuple[int, int]
_BELIEVED = (*RECORDERS, ALARMS.publisher)


def union(spans: Iterable[Span]) -> list[Span]:
    """Spans in order that do not touch; `(first, last)`, both included."""
    found: list[Span] = []
    for first, last in sorted(spans):
        if found and first <= found[-1][1] + 1:
            found[-1] = found[-1][0], max(last, found[-1][1])
        else:
            found.append((first, last))
    return found


def without(spans: list[Span], taken: list[Span]) -> list[Span]:
    """What of `spans` is in none of `taken`; all in order."""
    found = []
    for begin, last in spans:
        first = begin
        at = bisect_left(taken, first, key=lambda span: span[1])
        while first <= last and at < len(taken) and taken[at][0] <= last:
            if first < taken[at][0]:
                found.append((first, taken[at][0] - 1))
            first = taken[at][1] + 1
            at += 1
        if first <= last:
            found.append((first, last))
    return found


class Losses:
    """Samples and messages that are missing in a session."""

    def __init__(self) -> None:
        self._present: dict[int, list[Span]] = {}
        self._reported: dict[int, list[Span]] = {}
        self._messages: dict[tuple[str, int], list[Span]] = {}
        self._open: set[int] = set()

    def add(self, message: SampleBlock | Gap) -> None:
        """Record samples, or a report of losses."""
        if isinstance(message, SampleBlock):
            if len(message):
                span = message.seq, message.seq + len(message) - 1
                _extend(self._present.setdefault(message.boot, []), span)
        elif message.topic:
            if message.reporter in RECORDERS:
                place = message.topic, message.boot
                self._messages.setdefault(place, []).append((message.first, message.last))
        elif not (message.reporter in _BELIEVED or is_source(message.reporter)):
            return
        elif message.last < message.first:
            self._open.add(message.boot)
        else:
            self._reported.setdefault(message.boot, []).append((message.first, message.last))

    def missing(self, boots: Iterable[int] | None = None) -> list[Span]:
        """Where samples of these boots are missing; None for all known boots."""
        asked = {**self._present, **self._reported} if boots is None else boots
        return [span for boot in asked for span in self._missing_of(boot)]

    def _missing_of(self, boot: int) -> list[Span]:
        present = union(self._present.get(boot, ()))
        between = [(a[1] + 1, b[0] - 1) for a, b in pairwise(present)]
        return without(union([*between, *self._reported.get(boot, ())]), present)

    @property
    def unknown_ends(self) -> int:
        """Boots whose end is missing by an unknown number of samples."""
        return len(self._open)

    @property
    def messages(self) -> dict[str, int]:
        """Messages missing by topic; the end of a run of unknown length counts as none."""
        found: dict[str, int] = {}
        for (topic, _), spans in self._messages.items():
            known = union(span for span in spans if span[0] <= span[1])
            found[topic] = found.get(topic, 0) + count(known)
        return found


def count(spans: Iterable[Span]) -> int:
    """Numbers in spans that do not overlap."""
    return sum(last - first + 1 for first, last in spans)


def _extend(spans: list[Span], span: Span) -> None:
    """Append a span, merged with the last if adjacent: a session has millions of blocks."""
    if spans and span[0] == spans[-1][1] + 1:
        spans[-1] = spans[-1][0], span[1]
    else:
        spans.append(span)
