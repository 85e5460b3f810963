"""Where the fields of a block of samples or estimates lie in its protobuf bytes."""

import struct
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import IntArray

_EIGHT = 8
"""Size of a time or value [bytes]."""
NUMBERS_KEPT = 512
"""Numbers whose bytes are remembered: a boot comes with each of its blocks."""
NAMES_KEPT = 32
"""Sets of names that layouts share."""
_LONGEST_NUMBER = 9
"""Bytes of a number of 63 bits, the longest that `Layout.first_numbers` reads."""
Span = tuple[int, int]
Names = tuple[tuple[str, str, bool], ...]
"""Name and unit of each column, and whether it has quality."""


class UnfamiliarError(Exception):
    """An encoding that this module leaves to the general decoder."""


@dataclass(frozen=True, slots=True)
class ColumnPlace:
    """Offsets of a column's values and quality; -1 for none."""

    name: str
    unit: str
    values: int
    quality: int


@dataclass(frozen=True)
class Layout:
    """The layout of blocks of one kind, length and set of columns.

    Attributes:
        samples: samples per block.
        device: offsets of the device's name, None for an empty one.
        boot, seq: offsets of these numbers, None for 0.
        times: offsets of its integer arrays.
        parts: all other bytes, in order.
        starts: the offset of each part.
    """

    samples: int
    device: Span | None
    boot: Span | None
    seq: Span | None
    times: tuple[int, ...]
    columns: tuple[ColumnPlace, ...]
    parts: tuple[bytes, ...]
    starts: tuple[int, ...]

    @cached_property
    def reader(self) -> struct.Struct:
        """Takes what stands in place of `parts` from a block of equal length in one call.

        A look at each of forty parts takes three times as long.
        """
        form, at = [], 0
        for start, part in zip(self.starts, self.parts, strict=True):
            form.append(f"{start - at}x{len(part)}s")
            at = start + len(part)
        return struct.Struct("".join(form))

    @cached_property
    def names(self) -> Names:
        """Name and unit of each column, and whether it has quality."""
        return _same(tuple((place.name, place.unit, place.quality >= 0) for place in self.columns))

    @cached_property
    def plain_names(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of each column; none if one has quality."""
        return _plain(self.names)

    @cached_property
    def words(self) -> NDArray[np.intp]:
        """Offsets of the times, then of the values; shape (times and columns, samples)."""
        starts = [*self.times, *(place.values for place in self.columns)]
        return np.add.outer(starts, _EIGHT * np.arange(self.samples))

    @cached_property
    def flags(self) -> NDArray[np.intp]:
        """Offsets of the quality of the columns that have it; shape (columns, samples)."""
        starts = [place.quality for place in self.columns if place.quality >= 0]
        return np.add.outer(np.array(starts, np.intp), np.arange(self.samples))

    @cached_property
    def notes(self) -> dict[object, Any]:
        """What readers keep with it, each under a key of its own."""
        return {}

    @cached_property
    def shared(self) -> NDArray[np.intp]:
        """Offsets of all bytes that blocks of one boot share: those but `seq` and the arrays."""
        fixed = zip(self.starts, self.parts, strict=True)
        spans = [(start, start + len(part)) for start, part in fixed]
        spans += [span for span in (self.device, self.boot) if span is not None]
        return np.concatenate([np.arange(*span) for span in spans])

    def first_numbers(self, raw: NDArray[np.uint8]) -> tuple[IntArray, NDArray[np.bool_]]:
        """`seq` of each of several blocks, and whether it is one that fills its place.

        Args:
            raw: the bytes of a block in each row, which has this layout, shape (m, any).
        """
        if self.seq is None:
            return np.zeros(len(raw), np.int64), np.ones(len(raw), np.bool_)
        parts = raw[:, slice(*self.seq)]
        width = parts.shape[1]
        if width > _LONGEST_NUMBER:
            return np.zeros(len(raw), np.int64), np.zeros(len(raw), np.bool_)
        ends = ((parts >> 7) == (np.arange(width) < width - 1)).all(axis=1)
        bits = (parts & 0x7F).astype(np.int64) << 7 * np.arange(width)
        value = bits.sum(axis=1)
        return (value >> 1) ^ -(value & 1), ends

    def head(self, data: bytes) -> tuple[str, int, int]:
        """Device, boot and number of the first sample.

        Raises:
            ValueError: the device's name is no text.
        """
        device = "" if self.device is None else data[slice(*self.device)].decode()
        boot = 0 if self.boot is None else integer(data, self.boot)
        return device, boot, 0 if self.seq is None else integer(data, self.seq)


@dataclass(frozen=True, eq=False)
class Form:
    """What blocks of one boot and length have in common.

    Attributes:
        device, boot: of which they are.
        layout: of the first of them.
        fixed: the bytes that they share, with zeros for the flags of quality, and elsewhere.
        mask: 255 where bytes have to be those, else 0.
        facts: where the rest lies.
        words: the offsets of times, then of each column's values.
    """

    device: str
    boot: int
    layout: Layout
    fixed: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    facts: tuple[int, ...]
    words: tuple[int, ...]

    @property
    def names(self) -> Names:
        """Of their columns."""
        return self.layout.names


@lru_cache(maxsize=NAMES_KEPT)
def _same(names: Names) -> Names:
    """The first of equal names: layouts of many lengths have those of few kinds of blocks."""
    return names


@lru_cache(maxsize=NAMES_KEPT)
def _plain(names: Names) -> tuple[tuple[str, str], ...]:
    judged = any(quality for _, _, quality in names)
    return () if judged else tuple((name, unit) for name, unit, _ in names)


def varint(data: bytes, at: int) -> tuple[int, int]:
    """The unsigned number at an offset, and the offset after it.

    Raises:
        UnfamiliarError: it is longer than 64 bits.
        IndexError: the bytes end before it does.
    """
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if value >> 64 or shift > 70:
            raise UnfamiliarError
        if byte < 0x80:
            return value, at


@lru_cache(maxsize=NUMBERS_KEPT)
def filling(encoded: bytes) -> int | None:
    """The unsigned number that fills these bytes; None if it does not.

    Raises:
        UnfamiliarError: it is longer than 64 bits.
    """
    try:
        value, end = varint(encoded, 0)
    except IndexError:
        return None
    return value if end == len(encoded) else None


def integer(data: bytes, span: Span) -> int:
    """A zigzag varint."""
    value = filling(data[span[0] : span[1]])
    if value is None:
        raise UnfamiliarError
    return (value >> 1) ^ -(value & 1)
