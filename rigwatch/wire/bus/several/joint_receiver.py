"""Receives a topic of all rigs of a process, and hands each rig what is its own.

joined/daq/samples ──▶ channel ──distribute──▶ share of rig a │ share of rig b │ …
rig/a/daq/samples/alone ──▶ channel ──────────────▲
"""

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from rigwatch.wire.bus.several.joint_message import split
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
    """

    def __init__(self, following: Following) -> None:
        self.strange: deque[Received] = deque(maxlen=WAITING)
        self._following = following
        self._rigs: dict[str, tuple[deque[Received], ...]] = {}
        self._lock = threading.Lock()

    def add(self, rig: str, receive: Receive, alone: Following) -> "Share":
        """What comes from now on of a rig, for one more reader; `alone`: what is not joined."""
        share = Share(self, rig, receive, alone)
        with self._lock:
            self._rigs[rig] = (*self._rigs.get(rig, ()), share.waiting)
        return share

    def remove(self, share: "Share") -> None:
        """Keep no more for a reader."""
        with self._lock:
            left = tuple(one for one in self._rigs.get(share.rig, ()) if one is not share.waiting)
            self._rigs[share.rig] = left
            if not left:
                del self._rigs[share.rig]

    def distribute(self) -> None:
        """Hand out what has come."""
        with self._lock:
            while (found := self._following()) is not None:
                data, sender, _ = found
                try:
                    parts = split(data)
                except MessageError:
                    self.strange.append(found)
                    continue
                for rig, mark, payload in parts:
                    for waiting in self._rigs.get(rig, ()):
                        waiting.append((payload, sender, mark))


class Share:
    """What one reader of a rig gets.

    Args:
        of: hands it out.
        rig: the rig's id.
        receive: the reader.
        alone: gives the messages that came alone.
    """

    def __init__(self, of: JointReceiver, rig: str, receive: Receive, alone: Following) -> None:
        self.rig = rig
        self.waiting: deque[Received] = deque(maxlen=WAITING)
        self._of, self._receive, self._alone = of, receive, alone
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
        self._passed, self._pause = 0, 0 if some else min(self._pause + 1, MOST_PASSED)

    def take(self) -> None:
        """Pass on what has come, in order."""
        with self._lock:
            self._of.distribute()
            self._look()
            while self.waiting:
                self._receive(*self.waiting.popleft())
            with suppress(IndexError):  # another rig's reader has been quicker
                while self._of.strange:
                    # It counts as rejected where it is found.
                    self._receive(*self._of.strange.popleft())

    def undeclare(self) -> None:
        """Get nothing more."""
        self._of.remove(self)
