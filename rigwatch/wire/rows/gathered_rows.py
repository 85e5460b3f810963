"""The blocks of many rigs out of joined messages at once, joined until their rigs take them.

    joined message ─▶ part of a rig whose row is open, and that simply follows its last one
                   │                                   └─▶ put behind what the row has gathered
                   └▶ any other part ─▶ the rig's share, and its row is closed

A recorder writes what has come a few times a second: to read each block by itself, of a dozen of
each rig and topic, took most of its time.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import threading
import time
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.bus import Part, Place, Source, join
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import (
    Block,
    ByteArray,
    Column,
    Form,
    Layout,
    SampleBlock,
    block_of,
    encode,
)
from rigwatch.wire.packed_numbers import WORD, word_at
from rigwatch.wire.rows.block_forms import (
    NO_FORM,
    OF_SAMPLES,
    OTHER,
    Kind,
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

ROOM, MOST_ASIDE = 256, 4
"""Samples that a row gathers before they are set aside as a block, and the blocks that may wait so:
of a rig whose turn does not come, further ones are handed out, and a ring keeps them."""
_TAKEN, _LEFT, _NEW, _FULL = range(4)
"""What has become of a part; the last two ask for something to be done first."""


class _Gathering(NamedTuple):
    """What rows have gathered, in arrays with a row for each rig.

    Attributes:
        samples: their number, shape (rows,).
        first: number of the first of them, shape (rows,).
        messages: of which these are made, shape (rows,).
        heard_at: monotonic time at which the last of them came [s], shape (rows,).
        words: bytes of their times and values, shape (rows, words, WORD * ROOM).
    """

    samples: IntArray
    first: IntArray
    messages: IntArray
    heard_at: FloatArray
    words: ByteArray


class Gathered(NamedTuple):
    """What a row has taken since it was asked before.

    Attributes:
        blocks: each continues the one before, but for a clock that was set back.
        messages: of which they are made.
        heard_at: monotonic time at which the last of them came, or the row was opened [s].
    """

    blocks: list[Block]
    messages: int
    heard_at: float


class GatheredRows(NamedRows):
    """Rows whose blocks are joined until they are taken.

    All but `taken` is called under the lock of the receiver that has them.

    Args:
        count: rows.
        kind: of the blocks.
    """

    def __init__(self, count: int, kind: Kind) -> None:
        super().__init__(count, kind)
        self._gathering = _Gathering(
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count),
            np.zeros((count, kind.words, WORD * ROOM), np.uint8),
        )
        self._layouts: list[Layout | None] = [None] * count
        self._aside: defaultdict[int, list[Block]] = defaultdict(list)
        self._lock = threading.Lock()

    def open(self, rig: str, source: Source, following: int, message: Place | None = None) -> bool:
        """See `NamedRows.open`. What the row had gathered before is forgotten."""
        with self._lock:
            if not super().open(rig, source, following, message):
                return False
            row = self._numbers[rig]
            if not self.state.forms.facts[row].any():
                self._layouts[row] = None  # blocks of another source, or with other columns
            self._gathering.samples[row] = self._gathering.messages[row] = 0
            self._aside.pop(row, None)
            self._gathering.heard_at[row] = time.monotonic()
            return True

    def taken(self, row: int) -> Gathered:
        """What a row has gathered since the last call, in any thread."""
        with self._lock:
            self._set_aside(row)
            messages = int(self._gathering.messages[row])
            self._gathering.messages[row] = 0
            heard_at = float(self._gathering.heard_at[row])
            return Gathered(self._aside.pop(row, []), messages, heard_at)

    def take(self, data: bytes, sender: str) -> list[Part]:
        """See `NamedRows.take`."""
        with self._lock:
            return super().take(data, sender)

    def _taken_of(self, data: bytes, raw: ByteArray, count: int, sender: int) -> BoolArray | None:
        at, now = 0, time.monotonic()
        parts, state = np.zeros((4, count), np.int64), (self.state, self._gathering)
        while 0 <= (at := _gather(raw, at, *state, sender, now, parts, self._kind.times)) < count:
            row, became, begin, end = parts[:, at].tolist()
            if became == _FULL and len(self._aside[row]) < MOST_ASIDE:
                self._set_aside(row)
            elif became == _FULL:
                self.state.open[row] = False
            else:
                self._learn(row, data[begin:end])
        if at < 0:
            return None
        taken: BoolArray = parts[1] == _TAKEN
        return taken

    def _suits(self, row: int, form: Form) -> bool:
        """Whether a form is of the row's source, with the columns of what the row has gathered."""
        known = self._layouts[row]
        if not super()._suits(row, form):
            return False
        if known is None:
            self._layouts[row] = form.layout
        elif known.names != form.names:
            self.state.forms.facts[row] = 0  # the next source begins anew
            return False
        return True

    def _set_aside(self, row: int) -> None:
        """Make a block of what a row has gathered."""
        n, source, layout = (
            int(self._gathering.samples[row]),
            self._sources[row],
            self._layouts[row],
        )
        if not n or source is None or layout is None:
            return
        self._gathering.samples[row] = 0
        words = self._kind.times + len(layout.columns)
        found = self._gathering.words[row, :words, : WORD * n].copy().view(np.int64)
        times, values = found[: self._kind.times], found[self._kind.times :].view(np.float64)
        quality = np.zeros((sum(judged for _, _, judged in layout.names), n), np.uint8)
        head = source.device, source.boot, int(self._gathering.first[row])
        kind: type[Any] = self._kind.message
        self._aside[row].append(block_of(kind, layout, head, (times, values, quality)))


def compile_gathering() -> None:
    """Gather a block, so that no message waits for the compiler."""
    rows, zeros = GatheredRows(1, OF_SAMPLES), np.zeros(1, np.int64)
    column = Column("", "", np.zeros(1), np.zeros(1, np.uint8))
    block = SampleBlock("rig", 1, 0, zeros, zeros, (column,))
    rows.name(0, "rig")
    rows.open("rig", Source("daq", "rig", 1, lambda _: True), 0)
    rows.take(join([("rig", b"", encode(block))]), "daq")


@kernel()
def _gather(  # noqa: PLR0917
    raw: ByteArray,
    begin: int,
    state: RowState,
    gathering: _Gathering,
    sender: int,
    now: float,
    parts: IntArray,
    times: int,
) -> int:
    """Take from part `begin` on what follows.

    Args:
        raw: the joined message.
        begin: the first part that has not been looked at.
        state, gathering: of the rows.
        sender: number of the process that has sent it.
        now: monotonic time [s].
        parts: row, what has become of it, begin and end of each part, filled from `begin` on.
        times: of a sample.

    Returns:
        Number of the parts; the part for which something is to be done first; -1 if this is no
        joined message.
    """
    count = parts.shape[1]
    if not is_whole(raw, count):
        return -1
    at = HEAD + LENGTHS * count
    for p in range(count):
        rig, mark, size = lengths_of(raw, p)
        start, at = at, at + rig + mark + size
        if p < begin:
            continue
        row, block = row_of(state, raw, start, rig), at - size
        parts[0, p], parts[1, p], parts[2, p], parts[3, p] = row, _LEFT, block, at
        if row < 0 or not state.open[row]:
            continue
        place = following_form(raw, start + rig, p, state, row, sender)
        if place == OTHER:
            state.open[row] = False
            continue
        if place == NO_FORM:
            parts[1, p] = _NEW
            return p
        if not _has_room(raw, block, state, gathering, row, place, times):
            parts[1, p] = _FULL
            return p
        _put(raw, block, state, gathering, row, place)
        gathering.heard_at[row] = now
        parts[1, p] = _TAKEN
    return count


@part()
def _put(  # noqa: PLR0917
    raw: ByteArray, block: int, state: RowState, gathering: _Gathering, row: int, place: int
) -> None:
    """Put a block of a form behind what its row has gathered."""
    have, n = gathering.samples[row], samples_of(state.forms, row, place)
    if have == 0:
        gathering.first[row] = state.following[row]
    for w in range(words_of(state.forms, row, place)):
        copy_word(raw, block, state.forms, row, place, w, gathering.words[row, w], WORD * have)
    gathering.samples[row] += n
    gathering.messages[row] += 1
    state.following[row] += n
    state.message[row] += 1


@part()
def _has_room(  # noqa: PLR0917
    raw: ByteArray,
    block: int,
    state: RowState,
    gathering: _Gathering,
    row: int,
    place: int,
    times: int,
) -> bool:
    """Whether a block can be joined to what its row has gathered, whose clock was not set back."""
    have, n = gathering.samples[row], samples_of(state.forms, row, place)
    if have == 0:
        return True
    last_ns = word_at(gathering.words[row, times - 1], WORD * (have - 1))
    first_ns = word_at(raw, block + state.forms.words[row, place, times - 1])
    return have + n <= ROOM and first_ns >= last_ns
