"""Numbers in the bytes of messages, for compiled loops."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import part

NO_NUMBER = -(1 << 62)
WORD = 8
"""Bytes of a time or a value."""
_LONGEST = 9
"""Bytes of a varint of 63 bits; a longer one is left to the general decoder."""


@part()
def filling_number(data: NDArray[np.uint8], at: int, end: int) -> int:
    """The zigzag varint that fills these bytes, 0 for none of them; `NO_NUMBER` if none does."""
    value = 0
    if end - at > _LONGEST:
        return NO_NUMBER
    for k in range(end - at):
        byte = np.int64(data[at + k])
        if (byte >= 0x80) != (k < end - at - 1):
            return NO_NUMBER
        value |= int(byte & 0x7F) << 7 * k
    return (value >> 1) ^ -(value & 1)


@part()
def word_at(data: NDArray[np.uint8], at: int) -> int:
    """Eight bytes, little endian."""
    value = np.int64(0)
    for k in range(WORD):
        value |= np.int64(data[at + k]) << 8 * k
    return int(value)


@part()
def put_word(to: NDArray[np.uint8], at: int, value: int) -> None:
    """Eight bytes, little endian."""
    for k in range(WORD):
        to[at + k] = value >> 8 * k & 0xFF
