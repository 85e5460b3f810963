"""The bytes of a block of samples, into which a compiled call writes its numbers.

One block of a rig differs from the next in its first number, its times, values and quality. So one
is encoded as usual, and the others get its bytes with their own numbers in the places that its
layout names: how a block is encoded stands in `rigwatch.wire.messages` alone.
"""

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import ByteArray, SampleBlock, encode, layout_of

_SEQ, _SEQ_END, _US, _T_NS, _CHANNELS = range(5)
"""Offsets in `Text.places`: of the first number and its end, both times, and for each channel of
its values and of its quality."""


class Text(NamedTuple):
    """Bytes of a message, and where its numbers stand in them."""

    whole: ByteArray
    places: IntArray


class MessageText:
    """Those of blocks as long as one of a rig.

    Args:
        block: of the rig, with a number, samples and quality for each channel.

    Attributes:
        size: of the message [bytes].
        state: for `write_text`.
    """

    def __init__(self, block: SampleBlock) -> None:
        whole = encode(block)
        layout = layout_of(SampleBlock, whole)
        columns = [(one.values, one.quality) for one in layout.columns]
        places = [*(layout.seq or (0, 0)), *layout.times, *[at for one in columns for at in one]]
        self.size = len(whole)
        # A copy, as bytes that cannot be written are of another type to numba.
        self.state = KeptState(Text(np.array([*whole], np.uint8), np.array(places)))


@part()
def write_text(  # noqa: PLR0917
    text: Text,
    to: ByteArray,
    first: int,
    device_us: IntArray,
    t_ns: IntArray,
    values: FloatArray,
    quality: ByteArray,
) -> None:
    """Write a block's message.

    Args:
        text: of blocks as long, whose first number takes as many bytes.
        to: as many bytes, filled.
        first: number of the first sample.
        device_us, t_ns: shape (n,).
        values, quality: shape (n, channels).
    """
    for k in range(to.size):
        to[k] = text.whole[k]
    rest, end = first << 1, text.places[_SEQ_END]
    for at in range(text.places[_SEQ], end):
        to[at] = rest & 0x7F | (0x80 if at < end - 1 else 0)
        rest >>= 7
    _write_numbers(to, text.places[_US], device_us)
    _write_numbers(to, text.places[_T_NS], t_ns)
    bits = values.view(np.int64)
    for c in range(values.shape[1]):
        _write_numbers(to, text.places[_CHANNELS + 2 * c], bits[:, c])
        at = text.places[_CHANNELS + 2 * c + 1]
        for k in range(t_ns.size):
            to[at + k] = quality[k, c]


@part()
def _write_numbers(to: ByteArray, at: int, numbers: IntArray) -> None:
    """Eight bytes for each, little endian."""
    for k in range(numbers.size):
        for byte in range(8):
            to[at + 8 * k + byte] = numbers[k] >> 8 * byte & 0xFF
