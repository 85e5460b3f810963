"""The bytes of blocks of samples, into which a compiled call writes their numbers.

A block of a rig differs from others as long of the same channels in its boot, its first number, its
times, values and quality. So one is encoded as usual, and the others get its bytes with their own
numbers in the places that its layout names: how a block is encoded stands in
`rigwatch.wire.messages` alone.
"""

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.delivery import RingStore
from rigwatch.wire.kept_state import KeptState
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import ByteArray, SampleBlock, encode, layout_of
from rigwatch.wire.packed_numbers import WORD, put_word

MOST_TEXTS = 512
"""Texts that are kept: all lengths that a reading of a line can have, of a few kinds of rigs."""
_BOOT, _BOOT_END, _SEQ, _SEQ_END, _US, _T_NS, _CHANNELS = range(7)
"""Offsets in `Text.places`: of the boot and the first number and their ends, of both times, and for
each channel of its values and of its quality."""


class Text(NamedTuple):
    """Bytes of a message, and where its numbers stand in them."""

    whole: ByteArray
    places: IntArray


class MessageText:
    """The text of blocks as long as one.

    Args:
        block: with a boot, a number, samples, and quality for each channel.

    Attributes:
        size: of the message [bytes].
        state: for `write_text`.
    """

    def __init__(self, block: SampleBlock) -> None:
        whole = encode(block)
        layout = layout_of(SampleBlock, whole)
        heads = [*(layout.boot or (0, 0)), *(layout.seq or (0, 0)), *layout.times]
        columns = [at for one in layout.columns for at in (one.values, one.quality)]
        self.size = len(whole)
        # A copy, as bytes that cannot be written are of another type to numba.
        self.state = KeptState(Text(np.array([*whole], np.uint8), np.array([*heads, *columns])))


class MessageTexts:
    """The texts of all rigs of a process."""

    def __init__(self) -> None:
        self._texts: dict[tuple[object, ...], MessageText] = {}

    def of(self, store: RingStore, seq: int, count: int) -> MessageText:
        """That of a block of so many samples from `seq` on, of a boot."""
        alike = store.device, store.layout, _bytes_of(store.boot), _bytes_of(seq), count
        if (known := self._texts.get(alike)) is None:
            if len(self._texts) >= MOST_TEXTS:
                self._texts.clear()
            known = self._texts[alike] = MessageText(store.empty_block(seq, count))
        return known


def _bytes_of(number: int) -> int:
    """How many bytes a positive number takes, less one."""
    return number.bit_length() // 7


@part()
def write_text(  # noqa: PLR0917
    text: Text,
    to: ByteArray,
    boot: int,
    first: int,
    device_us: IntArray,
    t_ns: IntArray,
    values: FloatArray,
    quality: ByteArray,
) -> None:
    """Write a block's message.

    Args:
        text: of blocks as long, whose boot and first number take as many bytes.
        to: as many bytes, filled.
        boot: positive, as is the next.
        first: number of the first sample.
        device_us, t_ns: shape (n,).
        values, quality: shape (n, channels).
    """
    for k in range(to.size):
        to[k] = text.whole[k]
    _write_number(to, text.places[_BOOT], text.places[_BOOT_END], boot)
    _write_number(to, text.places[_SEQ], text.places[_SEQ_END], first)
    _write_numbers(to, text.places[_US], device_us)
    _write_numbers(to, text.places[_T_NS], t_ns)
    bits = values.view(np.int64)
    for c in range(values.shape[1]):
        _write_numbers(to, text.places[_CHANNELS + 2 * c], bits[:, c])
        at = text.places[_CHANNELS + 2 * c + 1]
        for k in range(t_ns.size):
            to[at + k] = quality[k, c]


@part()
def _write_number(to: ByteArray, start: int, end: int, number: int) -> None:
    """A positive number that fills its place."""
    rest = number << 1
    for at in range(start, end):
        to[at] = rest & 0x7F | (0x80 if at < end - 1 else 0)
        rest >>= 7


@part()
def _write_numbers(to: ByteArray, at: int, numbers: IntArray) -> None:
    for k in range(numbers.size):
        put_word(to, at + WORD * k, numbers[k])
