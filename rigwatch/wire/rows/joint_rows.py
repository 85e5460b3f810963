"""The samples of many rigs out of joined messages at once: a row for each rig.

joined message ─▶ part of a rig whose row is open, and that simply follows its last one ─▶ Batch
               └▶ any other part ─▶ the rig's share, and its row is closed
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from collections import deque
from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import ByteArray
from rigwatch.wire.packed_numbers import WORD
from rigwatch.wire.rows.block_forms import (
    NO_FORM,
    OF_SAMPLES,
    OTHER,
    copy_word,
    samples_of,
    words_of,
)
from rigwatch.wire.rows.named_rows import (
    HEAD,
    LENGTHS,
    NamedRows,
    RowState,
    following_form,
    is_whole,
    lengths_of,
    row_of,
)


class Batch(NamedTuple):
    """Blocks of one joined message: each simply follows the last one of its rig.

    Attributes:
        rows: whose they are, shape (k,).
        samples: of each, shape (k,).
        first: number of the first sample of each, shape (k,).
        at: the samples before those of each, shape (k,).
        values_at: the values before those of each, shape (k,).
        begin, end: where the bytes of each lie in `data`, shape (k,).
        device_us, t_ns: of all samples, one block after the other.
        values: of all channels, one block after the other, each of shape (channels, n).
        data: the message.
    """

    rows: IntArray
    samples: IntArray
    first: IntArray
    at: IntArray
    values_at: IntArray
    begin: IntArray
    end: IntArray
    device_us: IntArray
    t_ns: IntArray
    values: FloatArray
    data: bytes

    def payload(self, place: int) -> bytes:
        """The bytes of a block."""
        return self.data[self.begin[place] : self.end[place]]


class JointRows(NamedRows):
    """Rows whose samples are judged message by message.

    All but `taken` is called under the lock of the receiver that has them.

    Args:
        count: rows.
    """

    def __init__(self, count: int) -> None:
        super().__init__(count, OF_SAMPLES)
        self._batches: deque[Batch] = deque()
        self._messages = 0
        self._last_message = np.zeros(count, np.int64)

    def _taken_of(self, data: bytes, raw: ByteArray, count: int, sender: int) -> BoolArray | None:
        room = len(data) // WORD + 1
        out = np.empty((2, room), np.int64), np.empty(room)
        numbers = [one.view(np.uint8) for one in (*out[0], out[1])]
        parts, at = np.zeros((8, count), np.int64), 0
        self._messages += 1
        last = self._last_message, self._messages
        while 0 <= (at := _read(raw, at, self.state, sender, *last, parts, *numbers)) < count:
            self._learn(int(parts[0, at]), data[parts[5, at] : parts[6, at]])
        if at < 0:
            return None
        taken: BoolArray = parts[1] > 0
        whole = bool(taken.all())
        if whole or taken.any():
            parts = parts if whole else np.ascontiguousarray(parts[:, taken])
            device_us, t_ns = out[0][:, : parts[1].sum()]
            row, n, first, at_sample, at_value, begin, end, _ = parts
            places = at_sample, at_value, begin, end
            self._batches.append(Batch(row, n, first, *places, device_us, t_ns, out[1], data))
        return taken

    def taken(self) -> list[Batch]:
        """What has been taken since the last call, in order."""
        # In another thread than a reader's, which may add some meanwhile.
        return [self._batches.popleft() for _ in range(len(self._batches))]


@kernel()
def _read(  # noqa: PLR0917
    raw: ByteArray,
    begin: int,
    state: RowState,
    sender: int,
    last_message: IntArray,
    message: int,
    parts: IntArray,
    device_us: ByteArray,
    t_ns: ByteArray,
    values: ByteArray,
) -> int:
    """Take from part `begin` on what follows; fills the rows of `parts` as `Batch` names them.

    Of a part that is not taken the samples are 0; the last row is its columns.

    Args:
        raw: the joined message.
        begin: the first part that has not been looked at.
        state: the rows.
        sender: number of the process that has sent it.
        last_message: number of the last message of which a block was taken, of each row.
        message: number of this one: a second block of a rig is left to its reader.
        parts: filled from `begin` on.
        device_us, t_ns, values: filled.

    Returns:
        Number of the parts; the part of an open row whose length is new, with its row and place; -1
        if this is no joined message.
    """
    count = parts.shape[1]
    if not is_whole(raw, count):
        return -1
    at, samples, numbers = HEAD + LENGTHS * count, 0, 0
    for p in range(count):
        rig, mark, size = lengths_of(raw, p)
        start, at = at, at + rig + mark + size
        if p >= begin:
            row, block = row_of(state, raw, start, rig), at - size
            parts[0, p], parts[1, p] = row, 0
            parts[3, p], parts[4, p], parts[5, p], parts[6, p] = samples, numbers, block, at
            if row < 0 or not state.open[row]:
                continue
            # A second block of a rig is left to its reader: each row is judged once.
            place = OTHER
            if last_message[row] != message:
                place = following_form(raw, start + rig, p, state, row, sender)
            if place == NO_FORM:
                return p
            if place == OTHER:
                state.open[row] = False
                continue
            n, columns = samples_of(state.forms, row, place), words_of(state.forms, row, place) - 2
            copy_word(raw, block, state.forms, row, place, 0, device_us, WORD * samples)
            copy_word(raw, block, state.forms, row, place, 1, t_ns, WORD * samples)
            for c in range(columns):
                to = WORD * (numbers + c * n)
                copy_word(raw, block, state.forms, row, place, 2 + c, values, to)
            parts[1, p], parts[2, p], parts[7, p] = n, state.following[row], columns
            state.following[row] += n
            last_message[row] = message
        samples += parts[1, p]
        numbers += parts[1, p] * parts[7, p]
    return count
