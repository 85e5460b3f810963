"""Rows for the rigs whose blocks come in joined messages, and which part of one is whose.

A row is open while nothing of its rig waits elsewhere, so nothing is overtaken. It is opened by the
rig's reader, which has read all that has come, and closed by whatever does not simply follow.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import BoolArray, IntArray
from rigwatch.wire.bus import Part, Place, Source, split
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray, Form
from rigwatch.wire.packed_numbers import WORD, word_at
from rigwatch.wire.rows.block_forms import (
    OTHER,
    Forms,
    Kind,
    form_at,
    form_of,
    new_forms,
    store_form,
)

LONGEST_ID = 128
"""Characters of a rig's id up to which it has a row."""
HEAD, LENGTHS = 2, 8
"""Bytes of a joined message before the lengths of its parts, and of those of each."""
_MARK = 2 * WORD
"""Bytes of the mark of a numbered message."""


class RowState(NamedTuple):
    """What a message is compared with, in arrays with a row for each rig.

    Attributes:
        ids, id_size: shape (rows, LONGEST_ID) and (rows,).
        slots: rows by the hash of their id, -1 for none; a power of two of them.
        open: whether a row takes what follows.
        sender: number of the process that sends its blocks.
        following: number of the next sample.
        run, message: of the next message in a numbered topic; the run is -1 in others.
        forms: of its blocks.
    """

    ids: ByteArray
    id_size: IntArray
    slots: IntArray
    open: BoolArray
    sender: IntArray
    following: IntArray
    run: IntArray
    message: IntArray
    forms: Forms


class NamedRows:
    """The rows of a process.

    All is called under the lock of the receiver that has them.

    Args:
        count: rows.
        kind: of the blocks.
    """

    def __init__(self, count: int, kind: Kind) -> None:
        self._kind = kind
        self._numbers: dict[str, int] = {}
        self._senders: dict[str, int] = {}
        self._sources: list[Source | None] = [None] * count
        self.state = RowState(
            np.zeros((count, LONGEST_ID), np.uint8),
            np.zeros(count, np.int64),
            np.full(1 << (2 * count).bit_length(), -1, np.int64),
            np.zeros(count, np.bool_),
            np.full(count, -1, np.int64),
            np.zeros(count, np.int64),
            np.full(count, -1, np.int64),
            np.zeros(count, np.int64),
            new_forms(count, kind),
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

    def open(self, rig: str, source: Source, following: int, message: Place | None = None) -> bool:
        """Take what follows of a rig from now on, if it has a row.

        Args:
            rig: its id.
            source: of its blocks.
            following: number of the next sample.
            message: run and number of the next message, None in a topic that is not numbered.
        """
        row = self._numbers.get(rig)
        if row is None:
            return False
        before = self._sources[row]
        if before is None or (before.device, before.boot) != (source.device, source.boot):
            self.state.forms.facts[row] = 0
        self.state.sender[row] = self._senders.setdefault(source.sender, len(self._senders))
        self.state.following[row] = following
        self.state.run[row], self.state.message[row] = message or (-1, 0)
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
        if known < 0 or len(data) < HEAD or not self.state.open.any():
            return split(data)
        raw = np.frombuffer(data, np.uint8)
        taken = self._taken_of(data, raw, int(raw[0]) | int(raw[1]) << 8, known)
        if taken is None:
            return split(data)  # which says what is wrong with it
        return [] if taken.all() else _left(data, ~taken)

    def _taken_of(self, data: bytes, raw: ByteArray, count: int, sender: int) -> BoolArray | None:
        """Read what follows out of a message; which of its parts were taken.

        Args:
            data, raw: the message.
            count: its parts.
            sender: number of the process that has sent it.

        Returns:
            None if it is no joined message.
        """
        raise NotImplementedError

    def _learn(self, row: int, payload: bytes) -> None:
        """Keep the form of a block whose length is new, unless it is not of the row's source."""
        form = form_of(self._kind, payload)
        if form is not None and self._suits(row, form):
            store_form(self.state.forms, row, form)
        else:
            self.state.open[row] = False

    def _suits(self, row: int, form: Form) -> bool:
        """Whether blocks of a form are of the row's source."""
        source = self._sources[row]
        return source is not None and source.is_of(form)


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
def row_of(state: RowState, raw: ByteArray, at: int, size: int) -> int:
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
def short_at(raw: ByteArray, at: int) -> int:
    """Two bytes, little endian."""
    return int(raw[at]) | int(raw[at + 1]) << 8


@part()
def is_whole(raw: ByteArray, count: int) -> bool:
    """Whether these are the bytes of so many messages that were joined."""
    at = HEAD + LENGTHS * count
    if at > raw.size:
        return False
    for p in range(count):
        rig, mark, size = lengths_of(raw, p)
        at += rig + mark + size
    return at == raw.size


@part()
def lengths_of(raw: ByteArray, p: int) -> tuple[int, int, int]:
    """Those of a part's rig, mark and payload."""
    at = HEAD + LENGTHS * p
    size = short_at(raw, at + 4) | short_at(raw, at + 6) << 16
    return short_at(raw, at), short_at(raw, at + 2), size


@part()
def following_form(  # noqa: PLR0917
    raw: ByteArray, rig: int, p: int, state: RowState, row: int, sender: int
) -> int:
    """The place of the form of a part that simply follows the last one of its row.

    Args:
        raw: the joined message.
        rig: where the id of the part's rig ends.
        p: the part.
        state: of the rows.
        row: of its rig, which is open.
        sender: number of the process that has sent the message.

    Returns:
        As `form_at` does.
    """
    _, mark, size = lengths_of(raw, p)
    if state.sender[row] != sender or not _is_next(raw, rig, mark, state, row):
        return OTHER
    return form_at(raw, rig + mark, size, state.forms, row, state.following[row])


@part()
def _is_next(raw: ByteArray, at: int, mark: int, state: RowState, row: int) -> bool:
    """Whether a mark is that of the next message of a row."""
    if state.run[row] < 0:
        return mark == 0
    if mark != _MARK or word_at(raw, at) != state.run[row]:
        return False
    return word_at(raw, at + WORD) == state.message[row]
