"""Decodes short blocks as they come over the bus: their numbers are gathered in one go.

    payload ──one index──▶ times │ values ──views──▶ arrays of the block's own

A view and a copy for each column cost more than the numbers of a block of some samples. Payloads
that wait together and follow one another become one block, with the objects of one.
"""

import struct
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages.blocks import owned
from rigwatch.wire.messages.layout import Layout
from rigwatch.wire.messages.message_types import ByteArray, Column, ColumnTable, EstimateBlock
from rigwatch.wire.messages.packed import (
    LARGEST_GATHERED,
    NO_QUALITY,
    UNFAMILIAR,
    K,
    decode_block,
    known_layout,
    layout_of,
)

T = TypeVar("T", bound=np.generic)
_TIME = struct.Struct("<q")
Numbers = tuple[IntArray, FloatArray, ByteArray]
"""Times, values and quality, each with the samples in the last axis."""
Gather = Callable[[Sequence[Layout], Sequence[bytes], int], Numbers | None]
"""Gathers the numbers of payloads with these layouts, if each continues the one before; the number
of the first sample is known. None if one does not, or has not its layout."""
_gather: Gather | None = None


def gather_with(gather: Gather | None) -> None:
    """Use a quicker way to read payloads that wait together (`rigwatch.wire.quick_joining`)."""
    global _gather  # noqa: PLW0603 -- as the process decides
    _gather = gather


@dataclass(frozen=True, slots=True)
class _Part:
    layout: Layout
    data: bytes
    device: str
    boot: int
    seq: int


def decode_own(kind: type[K], data: bytes) -> K:
    """Decode a block, with arrays of its own.

    Raises:
        MessageError: the bytes are not such a message, or its columns differ in length.
    """
    part = _part(kind, data)
    return owned(decode_block(kind, data)) if part is None else _block(kind, [part])


def decode_joined(kind: type[K], payloads: Sequence[bytes]) -> tuple[list[K], int]:
    """The blocks in `payloads`, joined where one continues another, and how many are not valid."""
    if _gather is not None and len(payloads) > 1:
        whole = _one_run(kind, payloads, _gather)
        if whole is not None:
            return [whole], 0
    blocks: list[K] = []
    run: list[_Part] = []
    rejected = 0
    for data in payloads:
        part = _part(kind, data)
        if run and not (part and _follows(run[-1], part)):
            blocks.append(_block(kind, run))
            run = []
        if part:
            run.append(part)
            continue
        try:
            blocks.append(owned(decode_block(kind, data)))
        except MessageError:
            rejected += 1
    if run:
        blocks.append(_block(kind, run))
    return blocks, rejected


def _one_run(kind: type[K], payloads: Sequence[bytes], gather: Gather) -> K | None:
    """The block that all of them make, if each has a known layout and continues the one before.

    As the other steps would make it, in a small part of their time.
    """
    first = _part(kind, payloads[0])
    layouts = [known_layout(kind, data) for data in payloads[1:]]
    if first is None or max(map(len, payloads)) > LARGEST_GATHERED:
        return None
    names = first.layout.names
    alike: list[Layout] = [
        one for one in layouts if one is not None and one.samples and one.names is names
    ]
    if len(alike) < len(layouts):
        return None
    numbers = gather([first.layout, *alike], payloads, first.seq)
    if numbers is None:
        return None
    return block_of(kind, first.layout, (first.device, first.boot, first.seq), numbers)


def _part(kind: type[K], data: bytes) -> _Part | None:
    """None if it is too large and read column by column, or its encoding is not the usual one."""
    if len(data) > LARGEST_GATHERED:
        return None
    try:
        layout = layout_of(kind, data)
        return _Part(layout, data, *layout.head(data)) if layout.samples else None
    except UNFAMILIAR:
        return None


def _follows(one: _Part, other: _Part) -> bool:
    return (
        other.seq == one.seq + one.layout.samples
        and other.boot == one.boot
        and other.device == one.device
        and (other.layout is one.layout or other.layout.names == one.layout.names)
        and _time_of(other, 0) >= _time_of(one, one.layout.samples - 1)  # the clock may be set back
    )


def _time_of(part: _Part, sample: int) -> int:
    """Unix time of a sample, counted from 0 [ns]."""
    (t_ns,) = _TIME.unpack_from(part.data, part.layout.times[-1] + _TIME.size * sample)
    return int(t_ns)


def _block(kind: type[K], run: Sequence[_Part]) -> K:
    first = run[0]
    numbers = _numbers(first) if len(run) == 1 else _joined(run)
    return block_of(kind, first.layout, (first.device, first.boot, first.seq), numbers)


def block_of(kind: type[K], layout: Layout, head: tuple[str, int, int], numbers: Numbers) -> K:
    """A block of these numbers, with the names of the layout's columns.

    Args:
        kind: of the block.
        layout: of its first bytes.
        head: its device, boot and first number.
        numbers: as many as it has samples.
    """
    times, values, quality = numbers
    if kind is EstimateBlock and layout.plain_names:
        table = ColumnTable(layout.plain_names, values)
        return kind(*head, times[0], table)  # type: ignore[call-arg, arg-type]
    rows, flags = iter(values), iter(quality)
    columns = tuple(
        [
            Column(name, unit, next(rows), next(flags) if judged else NO_QUALITY)
            for name, unit, judged in layout.names
        ]
    )
    return kind(*head, *times, columns)  # type: ignore[call-arg]


def _numbers(part: _Part) -> Numbers:
    times, values, quality = _gathered(part.layout, [part])
    return times[0], values[0], quality[0]


def _joined(run: Sequence[_Part]) -> Numbers:
    """The numbers of a run; payloads of one layout are gathered together."""
    ends = np.cumsum([part.layout.samples for part in run]).tolist()
    shape = run[0].layout
    quality = sum(judged for _, _, judged in shape.names)
    whole = (
        np.empty((len(shape.times), ends[-1]), np.int64),
        np.empty((len(shape.columns), ends[-1])),
        np.empty((quality, ends[-1]), np.uint8),
    )
    for places in _by_layout(run):
        layout = run[places[0]].layout
        found = _gathered(layout, [run[at] for at in places])
        for row, at in enumerate(places):
            span = slice(ends[at] - layout.samples, ends[at])
            for kind in range(len(whole)):
                whole[kind][:, span] = found[kind][row]
    return whole


def _by_layout(run: Sequence[_Part]) -> Collection[list[int]]:
    """The places in `run` of each layout."""
    found: dict[int, list[int]] = {}
    for at, part in enumerate(run):
        found.setdefault(id(part.layout), []).append(at)
    return found.values()


def _gathered(layout: Layout, parts: Sequence[_Part]) -> Numbers:
    """Times, values and quality of payloads of one layout; the first axis is the payload."""
    raw, times = b"".join([part.data for part in parts]), len(layout.times)
    # The eight bytes from each byte on; an index takes those that are a number.
    eights: IntArray = np.ndarray((len(raw) - 7,), np.int64, raw, strides=(1,))
    words = _taken(eights, layout.words, len(raw), len(parts))
    flags = _taken(np.frombuffer(raw, np.uint8), layout.flags, len(raw), len(parts))
    return words[:, :times], words[:, times:].view(np.float64), flags


def _taken(raw: NDArray[T], places: NDArray[np.intp], size: int, parts: int) -> NDArray[T]:
    """What is at these places of each of the parts of equal size; the first axis is the part."""
    if not places.size:
        return np.empty((parts, *places.shape), raw.dtype)
    if parts > 1:
        places = np.arange(0, size, size // parts)[:, None, None] + places
    found: NDArray[T] = raw[places]
    return found.reshape(parts, *found.shape[-2:])
