"""Makes one block of the payloads that wait together, in a compiled call.

A recorder of many rigs gets a dozen blocks of each rig before it writes them: to read them one by
one takes it most of its time. Processes of few rigs leave the compiler out, which takes 130 MB.
"""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.kept_state import KeptState, kept
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray, Layout, Numbers, gather_with, keep_layouts
from rigwatch.wire.packed_numbers import filling_number, word_at

MANY_LAYOUTS, LAYOUTS_ROOM = 512, 1 << 20
"""Layouts that are kept, and the sum of their blocks' sizes [bytes]: blocks of many rigs have all
lengths of a busy machine at once, and one without a layout is read slowly with those around it."""


class Places(NamedTuple):
    """Where the fields of a block lie in its bytes.

    Attributes:
        samples: their number, shape (1,).
        fixed: the bytes that all blocks of the layout share.
        parts: offset and size of each part of them, shape (parts, 2).
        heads: offset and size of the device's name and of the boot, shape (2, 2).
        seq: where the first number begins and ends, shape (2,).
        words: offsets of the times, then of the values.
        flags: offsets of the quality of the columns that have it.
    """

    samples: IntArray
    fixed: ByteArray
    parts: IntArray
    heads: IntArray
    seq: IntArray
    words: IntArray
    flags: IntArray


def join_quickly() -> None:
    """Join so in this process from now on."""
    nothing = np.zeros((0, 2), np.int64)
    none, empty = nothing[:, 0].copy(), np.zeros((0, 0), np.int64)
    like = Places(none, np.zeros(0, np.uint8), nothing, nothing, none, none, none)
    data = np.frombuffer(b"", np.uint8)
    # Compiled before the first message arrives.
    join_run(like, none, data, none, 0, 0, empty, empty.astype(np.uint8))
    gather_with(gathered)
    keep_layouts(MANY_LAYOUTS, LAYOUTS_ROOM)


def gathered(layouts: Sequence[Layout], payloads: Sequence[bytes], seq: int) -> Numbers | None:
    """See `rigwatch.wire.messages.block_decoding.Gather`."""
    first, places = layouts[0], [_places(layout) for layout in layouts]
    samples, times = sum([layout.samples for layout in layouts]), len(first.times)
    words = np.empty((times + len(first.columns), samples), np.int64)
    flags = np.empty((sum([judged for _, _, judged in first.names]), samples), np.uint8)
    joined = join_run(
        places[0].state,
        np.array([one.address for one in places]),
        np.frombuffer(b"".join(payloads), np.uint8),
        np.array([0, *accumulate([len(data) for data in payloads])]),
        seq,
        times - 1,
        words,
        flags,
    )
    return (words[:times], words[times:].view(np.float64), flags) if joined else None


def _places(layout: Layout) -> KeptState:
    """`Places` of a layout, which it keeps."""
    if (known := layout.notes.get(_places)) is None:
        known = layout.notes[_places] = _new_places(layout)
    return known


def _new_places(layout: Layout) -> KeptState:
    sizes = [len(part) for part in layout.parts]
    spans = [span or (0, 0) for span in (layout.device, layout.boot)]
    heads = [(start, stop - start) for start, stop in spans]
    words = [*layout.times, *(place.values for place in layout.columns)]
    flags = [place.quality for place in layout.columns if place.quality >= 0]
    return KeptState(
        Places(
            np.array([layout.samples]),
            np.array([*b"".join(layout.parts)], np.uint8),
            np.array([*zip(layout.starts, sizes, strict=True)], np.int64),
            np.array(heads, np.int64),
            np.array(layout.seq or (0, 0), np.int64),
            np.array(words, np.int64),
            np.array(flags, np.int64),
        )
    )


@kernel()
def join_run(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    like: Places,
    layouts: IntArray,
    data: ByteArray,
    ends: IntArray,
    seq: int,
    clock: int,
    words: IntArray,
    flags: ByteArray,
) -> bool:
    """Gather the numbers of payloads, each of which continues the one before.

    Args:
        like: places of one layout.
        layouts: addresses of those of each payload, shape (p,).
        data: the payloads, one after the other.
        ends: where each begins, and where the last one ends, shape (p + 1,).
        seq: number of the first sample.
        clock: which of the times must not go back.
        words: times and values of all samples, filled, shape (times and columns, n).
        flags: quality of the columns that have it, filled, shape (columns, n).

    Returns:
        False if one has not its layout, another device or boot than the first, or does not follow.
    """
    at = 0
    for p in range(layouts.size):
        one, first = kept(like, layouts[p]), kept(like, layouts[0])
        here = data[ends[p] : ends[p + 1]]
        begin, end = one.seq[0], one.seq[1]
        if not _has_parts(one, here) or filling_number(here, begin, end) != seq + at:
            return False
        for k in range(2):
            if not _alike(here, one.heads[k], data, first.heads[k]):
                return False
        n = one.samples[0]
        for row in range(words.shape[0]):
            for k in range(n):
                words[row, at + k] = word_at(here, one.words[row] + 8 * k)
        for row in range(flags.shape[0]):
            for k in range(n):
                flags[row, at + k] = here[one.flags[row] + k]
        if at and words[clock, at] < words[clock, at - 1]:
            return False
        at += n
    return True


@part()
def _has_parts(one: Places, data: ByteArray) -> bool:
    at = 0
    for p in range(one.parts.shape[0]):
        start, size = one.parts[p, 0], one.parts[p, 1]
        for k in range(size):
            if data[start + k] != one.fixed[at + k]:
                return False
        at += size
    return True


@part()
def _alike(data: ByteArray, span: IntArray, other: ByteArray, span_of_other: IntArray) -> bool:
    """Whether the same bytes stand at both spans, each an offset and a size."""
    if span[1] != span_of_other[1]:
        return False
    for k in range(span[1]):  # noqa: SIM110 (no generators in a compiled kernel)
        if data[span[0] + k] != other[span_of_other[0] + k]:
            return False
    return True
