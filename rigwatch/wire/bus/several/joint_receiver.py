"""Receives a topic of all rigs of a process, and hands each rig what is its own.

joined/daq/samples ──▶ channel ──distribute──▶ share of rig a │ share of rig b │ …
rig/a/daq/samples/alone ──▶ channel ──────────────▲
"""

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from rigwatch.wire.bus.several.joint_message import split
from rigwatch.wire.bus.several.open_rows import OpenRows, Source
from rigwatch.wire.bus.transport import Receive
from rigwatch.wire.errors import MessageError

WAITING = 256
"""Messages of a rig's topic that wait for its reader: nine seconds of samples. Further ones push
out the oldest, which the reader gets from a ring."""
MOST_PASSED = 7
"""Looks for messages that came alone that are left out while there are none: most rigs have none.
"""
Received = tuple[bytes, str, bytes]
"""A payload, its sender and its mark."""
Following = Callable[[], Received | None]
"""The next message of a key that has come, None if there is none."""


class JointReceiver:
    """One topic of several rigs.

    Args:
        following: gives the joined messages.

    Attributes:
        strange: what has come and is no joined message.
        rows: takes what simply follows where it is collected; None for nothing.
    """

    def __init__(self, following: Following) -> None:
        self.strange: deque[Received] = deque(maxlen=WAITING)
        self.rows: OpenRows | None = None
        self._following = following
        self._rigs: dict[str, tuple[Share, ...]] = {}
        self._lock = threading.Lock()

    def add(self, rig: str, receive: Receive, alone: Following) -> "Share":
        """What comes from now on of a rig, for one more reader; `alone`: what is not joined."""
        share = Share(self, rig, receive, alone)
        with self._lock:
            self._close(rig)
            self._rigs[rig] = (*self._rigs.get(rig, ()), share)
        return share

    def remove(self, share: "Share") -> None:
        """Keep no more for a reader."""
        with self._lock:
            self._close(share.rig)
            left = tuple(one for one in self._rigs.get(share.rig, ()) if one is not share)
            self._rigs[share.rig] = left
            if not left:
                del self._rigs[share.rig]

    def distribute(self) -> None:
        """Hand out what has come, but for what the rows take."""
        with self._lock:
            while (found := self._following()) is not None:
                self._hand_out(found)

    def name(self, row: int, rig: str) -> bool:
        """Give a row to a rig; False if there are none, or it can have none."""
        with self._lock:
            return self.rows is not None and self.rows.name(row, rig)

    def open(
        self,
        share: "Share",
        source: Source,
        following: int,
        is_read: Callable[[], bool],
        message: tuple[int, int] | None = None,
    ) -> bool:
        """Open the row of a rig whose only reader this is, if its messages come joined and none
        waits.

        Args:
            share: of the reader.
            source: whose blocks the row takes.
            following: number of the next sample.
            is_read: whether the reader has taken all that was passed on to it.
            message: run and number of the next message, None in a topic that is not numbered.
        """
        with self._lock:
            alone = len(self._rigs.get(share.rig, ())) == 1
            ready = share.comes_joined and not share.waiting and is_read()
            if self.rows is None or not alone or not ready:
                return False
            return self.rows.open(share.rig, source, following, message)

    def close(self, rig: str) -> None:
        """Close the row of a rig: all that comes is handed out."""
        with self._lock:
            self._close(rig)

    def _close(self, rig: str) -> None:
        if self.rows is not None:
            self.rows.close(rig)

    def _hand_out(self, found: Received) -> None:
        data, sender, _ = found
        try:
            parts = split(data) if self.rows is None else self.rows.take(data, sender)
        except MessageError:
            self.strange.append(found)
            return
        for rig, mark, payload in parts:
            self._close(rig)
            for share in self._rigs.get(rig, ()):
                share.comes_joined = True
                share.waiting.append((payload, sender, mark))


class Share:
    """What one reader of a rig gets.

    Args:
        of: hands it out.
        rig: the rig's id.
        receive: the reader.
        alone: gives the messages that came alone.

    Attributes:
        comes_joined: whether the last message that was found had been joined.
    """

    def __init__(self, of: JointReceiver, rig: str, receive: Receive, alone: Following) -> None:
        self.rig, self.of = rig, of
        self.comes_joined = False
        self.waiting: deque[Received] = deque(maxlen=WAITING)
        self._receive, self._alone = receive, alone
        self._passed = self._pause = 0
        self._lock = threading.Lock()

    def may_hold(self) -> bool:
        """Whether something has been handed out, or has come alone."""
        if not self.waiting and self._passed >= self._pause:
            with self._lock:
                self._look()
        self._passed += 1
        return bool(self.waiting)

    def _look(self) -> None:
        """Take what has come alone, and look the less often the longer nothing has."""
        before = len(self.waiting)
        for _ in range(WAITING):
            if (found := self._alone()) is None:
                break
            self.waiting.append(found)
        some = len(self.waiting) > before
        self.comes_joined = self.comes_joined and not some
        self._passed, self._pause = 0, 0 if some else min(self._pause + 1, MOST_PASSED)

    def take(self) -> None:
        """Pass on what has come, in order."""
        with self._lock:
            self.keep_order()
            self.of.distribute()
            self._look()
            while self.waiting:
                self._receive(*self.waiting.popleft())
            with suppress(IndexError):  # another rig's reader has been quicker
                while self.of.strange:
                    # It counts as rejected where it is found.
                    self._receive(*self.of.strange.popleft())

    def keep_order(self) -> None:
        """Something waits for the reader elsewhere: nothing may overtake it in a row."""
        self.of.close(self.rig)

    def undeclare(self) -> None:
        """Get nothing more."""
        self.of.remove(self)
