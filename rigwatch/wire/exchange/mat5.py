"""Reads the numeric arrays and texts of a MAT file of version 5 (MATLAB v5 to v7).

    file    := text 116 | 8 | version u16 | "IM" | element…
    element := type u32 | size u32 | data, padded to 8 bytes      or, small: size u16 << 16 | type,
    4 bytes matrix  := flags | dimensions | name | real part              each an element

Written here because a damaged file can crash the process in SciPy's reader. Structures, sparse and
complex arrays are skipped. Source: MathWorks, "MAT-File Format", 2019.
"""

import itertools
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigwatch.wire.exchange.budget import Budget

Value = np.ndarray[Any, Any] | list[str] | str

_MATRIX, _COMPRESSED = 14, 15
_DATA_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8"} | {
    12: "i8",
    13: "u8",
}
_TEXTS = {2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _CHAR = 1, 4
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4"} | {
    14: "i8",
    15: "u8",
}
_COMPLEX = 0x0800
_MOST_PARTS = 10_000
"""Elements of one variable, cells of a cell array among them."""


class MatError(ValueError):
    """The bytes are not a MAT file of version 5; the text describes them."""


@dataclass(frozen=True, slots=True)
class _Element:
    kind: int
    data: memoryview


def read_mat5(content: bytes) -> dict[str, Value]:
    """Variables by name: numeric arrays in their own shape, texts, and cell arrays of texts.

    Raises:
        MatError: the file is damaged, or of another version.
    """
    order = _byte_order(content)
    found: dict[str, Value] = {}
    budget = Budget(len(content))
    try:
        for element in _elements(memoryview(content)[128:], order):
            name, value = _matrix(_unpacked(element, order, budget), order, budget)
            if value is not None:
                found[name] = value
    except (struct.error, zlib.error, ValueError, TypeError, RecursionError) as error:
        raise MatError(f"damaged: {error}") from error
    return found


def _byte_order(content: bytes) -> str:
    if content[:10] == b"MATLAB 7.3":
        raise MatError("a MATLAB v7.3 file (HDF5), expected v5 to v7: save it with save(…, '-v7')")
    orders = {b"IM": "<", b"MI": ">"}
    mark = content[126:128]
    if mark not in orders:
        raise MatError("no MAT file of version 5 to 7")
    return orders[mark]


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        start = at + 8
        if kind >> 16:
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            at += 8
        else:
            # Only compressed elements have no padding.
            at = start + (size if kind == _COMPRESSED else (size + 7) // 8 * 8)
        if start + size > len(data) or (start == at - 4 and size > 4):
            raise ValueError("an element is longer than the file")
        yield _Element(kind, data[start : start + size])
    if bytes(data[at:]).strip(b"\0"):
        raise ValueError("bytes behind the last element")


def _unpacked(element: _Element, order: str, budget: Budget) -> _Element:
    if element.kind != _COMPRESSED:
        return element
    unpacker = zlib.decompressobj()
    head = unpacker.decompress(element.data, 8)
    kind, size = struct.unpack(f"{order}II", head)
    # Four bytes or less lie in the head itself. What the head promises is charged before it is had.
    size = 0 if kind >> 16 else size
    budget.take(size)
    data = head + unpacker.decompress(unpacker.unconsumed_tail, size + 8)
    if not unpacker.eof:
        raise ValueError("a compressed variable is truncated, or longer than it says")
    return next(_elements(memoryview(data), order))


def _matrix(element: _Element, order: str, budget: Budget) -> tuple[str, Value | None]:
    """Name and value of a variable; None for a kind that is skipped."""
    if element.kind != _MATRIX:
        raise ValueError(f"an element of kind {element.kind} where a variable should be")
    parts = list(itertools.islice(_elements(element.data, order), _MOST_PARTS + 1))
    if len(parts) > _MOST_PARTS:
        raise ValueError(f"a variable of more than {_MOST_PARTS} parts")
    if len(parts) < 3:
        return "", None
    (flags,) = struct.unpack_from(f"{order}I", parts[0].data)
    shape = tuple(np.frombuffer(parts[1].data, f"{order}i4").tolist())
    name = bytes(parts[2].data).decode("ascii")
    kind = flags & 0xFF
    if kind == _CELL:
        return name, _texts(parts[3:], order, budget)
    if kind == _CHAR and len(parts) > 3:
        return name, _text(parts[3], order)
    if kind not in _CLASSES or flags & _COMPLEX or len(parts) < 4:
        return name, None
    values = np.frombuffer(parts[3].data, order + _DATA_TYPES.get(parts[3].kind, "V"))
    if min(shape) < 0 or values.size != int(np.prod(shape, dtype=np.float64)):
        raise ValueError(f"{name} has {values.size} values, expected the shape {shape}")
    budget.take(values.size * np.dtype(_CLASSES[kind]).itemsize)
    with np.errstate(over="ignore", invalid="ignore"):  # damaged: not what its class holds
        return name, values.reshape(shape, order="F").astype(_CLASSES[kind])


def _texts(cells: list[_Element], order: str, budget: Budget) -> list[str] | None:
    found = [_matrix(cell, order, budget)[1] for cell in cells]
    texts = [value for value in found if isinstance(value, str)]
    return texts if len(texts) == len(found) else None


def _text(element: _Element, order: str) -> str:
    encoding = _TEXTS.get(element.kind, "latin-1")
    if encoding in ("utf-16", "utf-32"):
        encoding += "-le" if order == "<" else "-be"
    return bytes(element.data).decode(encoding)
