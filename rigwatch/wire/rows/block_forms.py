"""Recognises blocks that differ from an earlier one in number, times and values alone.

The other bytes of blocks of one boot and length are the same: one comparison covers the device, the
boot, names, lengths, and that no reading is flagged.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import (
    UNFAMILIAR,
    ByteArray,
    EstimateBlock,
    Form,
    SampleBlock,
    layout_of,
)
from rigwatch.wire.packed_numbers import WORD, filling_number

MOST_FORMS = 24
"""Forms of a rig that are kept: blocks have a few lengths, and most of up to twenty samples on a
busy machine, where to learn them again and again takes the time that it lacks."""
NO_FORM, OTHER = -1, -2
"""There is no form of this length; it is another block than the following one without a flag."""
_LENGTH, _SAMPLES, _SEQ, _SEQ_END, _WORDS = range(5)


class Kind(NamedTuple):
    """Blocks that are recognised.

    Attributes:
        message: their class.
        longest: size of a block up to which it is [bytes].
        times: of a sample.
        words: times and values of a sample, at most.
    """

    message: type[SampleBlock | EstimateBlock]
    longest: int
    times: int
    words: int


OF_SAMPLES = Kind(SampleBlock, 2048, 2, 18)
OF_ESTIMATES = Kind(EstimateBlock, 4096, 1, 33)
MOST_COLUMNS = OF_SAMPLES.words - OF_SAMPLES.times
MOST_SAMPLES = OF_SAMPLES.longest // (OF_SAMPLES.times * WORD)
"""Columns and samples that a block of samples may have."""


class Forms(NamedTuple):
    """The forms of each row.

    Attributes:
        fixed, mask: shape (rows, MOST_FORMS, longest).
        facts: shape (rows, MOST_FORMS, 5); the first, a block's length, is 0 where there is none.
        words: offsets of times and values, shape (rows, MOST_FORMS, words).
    """

    fixed: ByteArray
    mask: ByteArray
    facts: IntArray
    words: IntArray


def new_forms(rows: int, kind: Kind) -> Forms:
    """No form of any row."""
    return Forms(
        np.zeros((rows, MOST_FORMS, kind.longest), np.uint8),
        np.zeros((rows, MOST_FORMS, kind.longest), np.uint8),
        np.zeros((rows, MOST_FORMS, _WORDS + 1), np.int64),
        np.zeros((rows, MOST_FORMS, kind.words), np.int64),
    )


def form_of(kind: Kind, data: bytes) -> Form | None:
    """The form of a block; None if it is too long, or encoded in an unusual way."""
    if len(data) > kind.longest:
        return None
    try:
        layout = layout_of(kind.message, data)
        device, boot, _ = layout.head(data)
    except UNFAMILIAR:
        return None
    words = *layout.times, *(place.values for place in layout.columns)
    if not layout.samples or not kind.times < len(words) <= kind.words:
        return None
    fixed, mask = np.zeros((2, len(data)), np.uint8)
    mask[layout.shared] = mask[layout.flags] = 255
    fixed[layout.shared] = np.frombuffer(data, np.uint8)[layout.shared]
    facts = len(data), layout.samples, *(layout.seq or (0, 0)), len(words)
    return Form(device, boot, layout, fixed, mask, facts, words)


def store_form(forms: Forms, row: int, form: Form) -> None:
    """Keep a form of a row."""
    free = np.flatnonzero(forms.facts[row, :, _LENGTH] == 0)
    # One of the others that is needed again is learnt again.
    place = int(free[0]) if free.size else form.layout.samples % MOST_FORMS
    size = len(form.fixed)
    forms.fixed[row, place, :size], forms.mask[row, place, :size] = form.fixed, form.mask
    forms.words[row, place, : len(form.words)] = form.words
    forms.facts[row, place] = form.facts


@part()
def form_at(  # noqa: PLR0917
    raw: ByteArray, at: int, size: int, forms: Forms, row: int, following: int
) -> int:
    """The place of the form that a block has which simply follows.

    Args:
        raw: bytes, those of the block from `at` on.
        at, size: of the block.
        forms, row: whose block it is.
        following: number of the sample that has to be its first.

    Returns:
        `NO_FORM` if the row has none of this length, `OTHER` if the block is another one.
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
            return OTHER
        return place
    return NO_FORM


@part()
def samples_of(forms: Forms, row: int, place: int) -> int:
    """Samples of a block of this form."""
    return forms.facts[row, place, _SAMPLES]


@part()
def words_of(forms: Forms, row: int, place: int) -> int:
    """Times and values of a sample of this form."""
    return forms.facts[row, place, _WORDS]


@part()
def copy_word(  # noqa: PLR0917
    raw: ByteArray,
    at: int,
    forms: Forms,
    row: int,
    place: int,
    word: int,
    to: ByteArray,
    begin: int,
) -> None:
    """Copy one time or value of all samples of the block at `at`, to `begin` and what follows."""
    start = at + forms.words[row, place, word]
    for k in range(WORD * forms.facts[row, place, _SAMPLES]):
        to[begin + k] = raw[start + k]
