"""Reads a block of samples that differs from an earlier one in number, times and values alone.

The other bytes of blocks of one boot and length are the same: one comparison covers the device, the
boot, names, lengths, and that no reading is flagged.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import UNFAMILIAR, ByteArray, Form, SampleBlock, layout_of
from rigwatch.wire.packed_numbers import WORD, filling_number

LONGEST_BLOCK, MOST_COLUMNS = 2048, 16
"""Size of a block [bytes] and number of its columns up to which it is read here."""
MOST_SAMPLES = LONGEST_BLOCK // 16
"""A sample has two times at least."""
MOST_FORMS = 24
"""Forms of a rig that are kept: blocks have a few lengths, and most of up to twenty samples on a
busy machine, where to learn them again and again takes the time that it lacks."""
_LENGTH, _SAMPLES, _SEQ, _SEQ_END, _DEVICE_US, _T_NS, _COLUMNS = range(7)


class Forms(NamedTuple):
    """The forms of each row.

    Attributes:
        fixed, mask: shape (rows, MOST_FORMS, LONGEST_BLOCK).
        facts: shape (rows, MOST_FORMS, 7); the first, a block's length, is 0 where there is none.
        columns: shape (rows, MOST_FORMS, MOST_COLUMNS).
    """

    fixed: ByteArray
    mask: ByteArray
    facts: IntArray
    columns: IntArray


def new_forms(rows: int) -> Forms:
    """No form of any row."""
    return Forms(
        np.zeros((rows, MOST_FORMS, LONGEST_BLOCK), np.uint8),
        np.zeros((rows, MOST_FORMS, LONGEST_BLOCK), np.uint8),
        np.zeros((rows, MOST_FORMS, _COLUMNS + 1), np.int64),
        np.zeros((rows, MOST_FORMS, MOST_COLUMNS), np.int64),
    )


def form_of(data: bytes) -> Form | None:
    """The form of a block of samples; None if it is too long, or encoded in an unusual way."""
    if len(data) > LONGEST_BLOCK:
        return None
    try:
        layout = layout_of(SampleBlock, data)
        device, boot, _ = layout.head(data)
    except UNFAMILIAR:
        return None
    if not layout.samples or not 0 < len(layout.columns) <= MOST_COLUMNS:
        return None
    fixed, mask = np.zeros((2, len(data)), np.uint8)
    mask[layout.shared] = mask[layout.flags] = 255
    fixed[layout.shared] = np.frombuffer(data, np.uint8)[layout.shared]
    seq = layout.seq or (0, 0)
    facts = len(data), layout.samples, *seq, *layout.times, len(layout.columns)
    columns = tuple(place.values for place in layout.columns)
    return Form(device, boot, layout.samples, layout.names, fixed, mask, facts, columns)


def store_form(forms: Forms, row: int, place: int, form: Form) -> None:
    """Keep a form of a row."""
    size = len(form.fixed)
    forms.fixed[row, place, :size], forms.mask[row, place, :size] = form.fixed, form.mask
    forms.columns[row, place, : len(form.columns)] = form.columns
    forms.facts[row, place] = form.facts


@part()
def read_block(  # noqa: PLR0917
    raw: ByteArray,
    at: int,
    size: int,
    forms: Forms,
    row: int,
    following: int,
    device_us: ByteArray,
    t_ns: ByteArray,
    values: ByteArray,
) -> int:
    """Read a block of `size` bytes from `at` on.

    Args:
        raw: the bytes.
        at, size: of the block.
        forms, row: whose block it is.
        following: number of the sample that has to be its first.
        device_us, t_ns, values: the bytes of arrays, filled from their beginning.

    Returns:
        Number of its samples; 0 if the row has no form of this length, -1 if it is another block
        than the following one without a flag.
    """
    for place in range(MOST_FORMS):
        facts = forms.facts[row, place]
        if facts[_LENGTH] != size:
            continue
        fixed, mask = forms.fixed[row, place], forms.mask[row, place]
        differs = 0
        for k in range(size):
            differs |= (raw[at + k] ^ fixed[k]) & mask[k]
        if differs != 0 or filling_number(raw, at + facts[_SEQ], at + facts[_SEQ_END]) != following:
            return -1
        n = facts[_SAMPLES]
        wide = WORD * n
        for k in range(wide):
            device_us[k] = raw[at + facts[_DEVICE_US] + k]
            t_ns[k] = raw[at + facts[_T_NS] + k]
        for c in range(facts[_COLUMNS]):
            start = at + forms.columns[row, place, c]
            for k in range(wide):
                values[c * wide + k] = raw[start + k]
        return n
    return 0
