"""The samples of many rigs out of joined messages at once: a row for each rig.

    joined message ─▶ part of a rig whose row is open, and that simply follows its last one ─▶ Batch
                   └▶ any other part ─▶ the rig's share, and its row is closed

A row is open while nothing of its rig waits elsewhere, so nothing is overtaken. It is opened by the
rig's reader, which has read all that has come, and closed by whatever does not simply follow.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from collections import deque
from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.bus import Part, Source, split
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray
from rigwatch.wire.packed_numbers import WORD
from rigwatch.wire.rows.sample_rows import (
    MOST_FORMS,
    Forms,
    form_of,
    new_forms,
    read_block,
    store_form,
)

LONGEST_ID = 128
"""Characters of a rig's id up to which it has a row."""
_HEAD, _LENGTHS = 2, 8


class RowState(NamedTuple):
    """What a message is compared with, in arrays with a row for each rig.

    Attributes:
        ids, id_size: shape (rows, LONGEST_ID) and (rows,).
        slots: rows by the hash of their id, -1 for none; a power of two of them.
        open: whether a row takes what follows.
        sender: number of the process that sends its samples.
        following: number of the next sample.
        message: number of the last message of which a block was taken.
        forms: of its blocks.
    """

    ids: ByteArray
    id_size: IntArray
    slots: IntArray
    open: BoolArray
    sender: IntArray
    following: IntArray
    message: IntArray
    forms: Forms


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


class JointRows:
    """The rows of a process.

    All but `taken` is called under the lock of the receiver that has them.

    Args:
        count: rows.
    """

    def __init__(self, count: int) -> None:
        self._numbers: dict[str, int] = {}
        self._senders: dict[str, int] = {}
        self._sources: list[Source | None] = [None] * count
        self._batches: deque[Batch] = deque()
        self._messages = 0
        self.state = RowState(
            np.zeros((count, LONGEST_ID), np.uint8),
            np.zeros(count, np.int64),
            np.full(1 << (2 * count).bit_length(), -1, np.int64),
            np.zeros(count, np.bool_),
            np.full(count, -1, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            new_forms(count),
        )

    def name(self, row: int, rig: str) -> bool:
        """Give a row to a rig; False if it can have none, or has another one."""
        if not rig.isascii() or not 0 < len(rig) <= LONGEST_ID:
            return False
        if rig in self._numbers:
            return self._numbers[rig] == row
        self._numbers = {known: at for known, at in self._numbers.items() if at != row}
        self._numbers[rig], self._sources[row] = row, None
        self.state.ids[row, : len(rig)] = np.frombuffer(rig.encode(), np.uint8)
        self.state.id_size[row] = len(rig)
        self.state.slots.fill(-1)
        _enter_ids(self.state)
        return True

    def open(self, rig: str, source: Source, following: int) -> bool:
        """Take what follows of a rig from now on, if it has a row."""
        row = self._numbers.get(rig)
        if row is None:
            return False
        before = self._sources[row]
        if before is None or (before.device, before.boot) != (source.device, source.boot):
            self.state.forms.facts[row] = 0
        self.state.sender[row] = self._senders.setdefault(source.sender, len(self._senders))
        self.state.following[row] = following
        self._sources[row] = source
        self.state.open[row] = True
        return True

    def is_open(self, row: int) -> bool:
        """Whether a row takes what follows."""
        return bool(self.state.open[row])

    def close(self, rig: str) -> None:
        """Take no more of a rig."""
        if (row := self._numbers.get(rig)) is not None:
            self.state.open[row] = False

    def take(self, data: bytes, sender: str) -> list[Part]:
        """Take what follows out of a joined message; what is left of it, in order.

        Raises:
            MessageError: these are not the bytes of such a message.
        """
        known = self._senders.get(sender, -1)
        if known < 0 or len(data) < _HEAD or not self.state.open.any():
            return split(data)
        raw = np.frombuffer(data, np.uint8)
        count = int(raw[0]) | int(raw[1]) << 8
        room = len(data) // WORD + 1
        out = np.empty((7, count), np.int64), np.empty((2, room), np.int64), np.empty(room)
        self._messages += 1
        parts, numbers = out[0], [one.view(np.uint8) for one in out[1:]]
        at = _read(raw, 0, self.state, known, self._messages, parts, *numbers)
        while 0 <= at < count:
            self._learn(int(parts[0, at]), data[parts[5, at] : parts[6, at]])
            at = _read(raw, at, self.state, known, self._messages, parts, *numbers)
        if at < 0:
            return split(data)  # which says what is wrong with it
        taken = parts[1] > 0
        whole = bool(taken.all())
        if whole or taken.any():
            parts = parts if whole else np.ascontiguousarray(parts[:, taken])
            row, n, first, at_sample, at_value, begin, end = parts
            device_us, t_ns = out[1][:, : n.sum()]
            places = at_sample, at_value, begin, end
            self._batches.append(Batch(row, n, first, *places, device_us, t_ns, out[2], data))
        return [] if whole else _left(data, ~taken)

    def _learn(self, row: int, payload: bytes) -> None:
        """Keep the form of a block whose length is new, unless it is not of the row's source."""
        form, source = form_of(payload), self._sources[row]
        if form is None or source is None or not source.is_of(form):
            self.state.open[row] = False
            return
        facts = self.state.forms.facts[row]
        free = np.flatnonzero(facts[:, 0] == 0)
        # One of the others that is needed again is learnt again.
        place = int(free[0]) if free.size else form.samples % MOST_FORMS
        store_form(self.state.forms, row, place, form)

    def taken(self) -> list[Batch]:
        """What has been taken since the last call, in order."""
        # In another thread than a reader's, which may add some meanwhile.
        return [self._batches.popleft() for _ in range(len(self._batches))]


def _left(data: bytes, wanted: BoolArray) -> list[Part]:
    """These parts of a joined message."""
    return [one for one, kept in zip(split(data), wanted.tolist(), strict=True) if kept]


@kernel()
def _enter_ids(state: RowState) -> None:
    for row in range(state.id_size.size):
        if state.id_size[row] == 0:
            continue
        slot = _hash(state.ids[row], 0, state.id_size[row]) & (state.slots.size - 1)
        while state.slots[slot] >= 0:
            slot = (slot + 1) & (state.slots.size - 1)
        state.slots[slot] = row


@part()
def _hash(raw: ByteArray, at: int, size: int) -> int:
    found = 5381
    for k in range(size):
        found = (found * 33 + int(raw[at + k])) & 0xFFFFFFFF
    return found


@part()
def _row_of(state: RowState, raw: ByteArray, at: int, size: int) -> int:
    """The row of a rig's id; -1 if it has none."""
    last = state.slots.size - 1
    slot = _hash(raw, at, size) & last
    while state.slots[slot] >= 0:
        row = state.slots[slot]
        same = state.id_size[row] == size
        for k in range(size):
            same = same and state.ids[row, k] == raw[at + k]
        if same:
            return row
        slot = (slot + 1) & last
    return -1


@part()
def _short(raw: ByteArray, at: int) -> int:
    return int(raw[at]) | int(raw[at + 1]) << 8


@kernel()
def _read(  # noqa: PLR0917
    raw: ByteArray,
    begin: int,
    state: RowState,
    sender: int,
    message: int,
    parts: IntArray,
    times: ByteArray,
    values: ByteArray,
) -> int:
    """Take from part `begin` on what follows; fills the rows of `parts` as `Batch` names them.

    Of a part that is not taken the samples are 0.

    Returns:
        Number of the parts; the part of an open row whose length is new, with its row and place; -1
        if this is no joined message.
    """
    count = parts.shape[1]
    if not _is_whole(raw, count):
        return -1
    at, samples, numbers = _HEAD + _LENGTHS * count, 0, 0
    for p in range(count):
        rig, mark, size = _lengths(raw, p)
        start, at = at, at + rig + mark + size
        if p >= begin:
            row = _row_of(state, raw, start, rig)
            parts[0, p], parts[1, p] = row, 0
            if row < 0 or not state.open[row]:
                continue
            n = -1
            # A second block of a rig is left to its reader: each row is judged once.
            first = state.message[row] != message
            if first and mark == 0 and state.sender[row] == sender:
                parts[3, p], parts[4, p], parts[5, p], parts[6, p] = samples, numbers, at - size, at
                n = read_block(
                    raw,
                    at - size,
                    size,
                    state.forms,
                    row,
                    state.following[row],
                    times[0, WORD * samples :],
                    times[1, WORD * samples :],
                    values[WORD * numbers :],
                )
            if n == 0:
                return p
            if n < 0:
                state.open[row] = False
                continue
            parts[1, p], parts[2, p] = n, state.following[row]
            state.following[row] += n
            state.message[row] = message
        if parts[1, p] > 0:
            samples += parts[1, p]
            numbers += parts[1, p] * _columns_of(state, parts[0, p], size)
    return count


@part()
def _is_whole(raw: ByteArray, count: int) -> bool:
    """Whether these are the bytes of so many messages that were joined."""
    at = _HEAD + _LENGTHS * count
    if at > raw.size:
        return False
    for p in range(count):
        rig, mark, size = _lengths(raw, p)
        at += rig + mark + size
    return at == raw.size


@part()
def _lengths(raw: ByteArray, p: int) -> tuple[int, int, int]:
    """Those of a part's rig, mark and payload."""
    at = _HEAD + _LENGTHS * p
    size = _short(raw, at + 4) | _short(raw, at + 6) << 16
    return _short(raw, at), _short(raw, at + 2), size


@part()
def _columns_of(state: RowState, row: int, size: int) -> int:
    """Number of columns of a block of this length."""
    for place in range(MOST_FORMS):
        if state.forms.facts[row, place, 0] == size:
            return state.forms.facts[row, place, 6]
    return 0
