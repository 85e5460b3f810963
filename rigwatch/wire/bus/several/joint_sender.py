"""Sends a topic of a rig: among those of the process's other rigs, or so that such a process hears.

Among    rigs that share a link: one message for all, each rig's own only where it is heard
Alone    a rig of its own process: its message, and once more where a process of many listens
"""

import threading
from typing import Protocol

from rigwatch.wire.bus.several.burst import Burst
from rigwatch.wire.bus.several.joint_message import MOST_PARTS, Part, join, size_of

LARGEST = 48 << 10
"""Size up to which messages are joined [bytes]: Zenoh sends more than 64 kB in parts, and loses all
with one of them."""
ALONE = "alone"


class Line(Protocol):
    """One key at which is sent."""

    def put(self, payload: bytes, mark: bytes) -> None:
        """Send without waiting."""


class AttendedLine(Line, Protocol):
    """One that knows whether anybody listens."""

    @property
    def is_heard(self) -> bool:
        """Whether anybody listens, or may do so by now."""


def alone_key(key: str) -> str:
    """Where a message of one rig is sent once more for processes of several rigs."""
    return f"{key}/{ALONE}"


class JointSender:
    """The messages of one topic of all rigs that share a link, sent with the next burst.

    Args:
        line: where they are sent.
        burst: sends them.
    """

    def __init__(self, line: AttendedLine, burst: Burst) -> None:
        self._line, self._burst = line, burst
        self._waiting: list[Part] = []
        self._size = 0
        self._lock = threading.Lock()

    def add(self, part: Part) -> None:
        """Send with the next burst, or sooner if there is no room for more."""
        size = size_of(part)
        with self._lock:
            full = self._size + size > LARGEST or len(self._waiting) == MOST_PARTS
            if full:
                self._send()
            first = not self._waiting
            self._waiting.append(part)
            self._size += size
        if first and not full:
            self._burst.add(self.send)

    def add_joined(self, message: bytes) -> None:
        """Send with the next burst what has been joined already, of at most `LARGEST` bytes."""
        with self._lock:
            self._send()  # what came before
        self._burst.add(lambda: self._line.put(message, b""))

    def send(self) -> None:
        """Send what waits."""
        with self._lock:
            self._send()

    def _send(self) -> None:
        if self._waiting:
            self._line.put(join(self._waiting), b"")
        self._waiting, self._size = [], 0

    @property
    def is_heard(self) -> bool:
        """Whether a process of several rigs listens."""
        return self._line.is_heard


class Among:
    """A topic of a rig that shares its link.

    Args:
        rig: its id.
        own: at the rig's own key.
        alone: for processes of several rigs, what is too large to be joined.
        joint: those of all rigs.
        burst: sends what is put.
    """

    def __init__(
        self, rig: str, own: AttendedLine, alone: Line, joint: JointSender, burst: Burst
    ) -> None:
        self._rig, self._own, self._alone = rig, own, alone
        self._joint, self._burst = joint, burst

    @property
    def is_followed(self) -> bool:
        """Whether anybody listens at the rig's own key."""
        return self._own.is_heard

    @property
    def is_heard(self) -> bool:
        """Whether a process of several rigs listens."""
        return self._joint.is_heard

    @property
    def together_with(self) -> object:
        """Messages of those for which it is the same may be joined."""
        return self._joint

    def add_joined(self, message: bytes) -> None:
        """Send a joined message, with the next burst."""
        self._joint.add_joined(message)

    def put_own(self, payload: bytes, mark: bytes) -> None:
        """Send at the rig's own key alone, with the next burst."""
        self._burst.add(lambda: self._own.put(payload, mark))

    def put(self, payload: bytes, mark: bytes) -> None:
        """Send with the next burst."""
        if self.is_followed:
            self.put_own(payload, mark)
        part = self._rig, mark, payload
        if size_of(part) > LARGEST:
            self._burst.add(lambda: self._alone.put(payload, mark))
        elif self._joint.is_heard:
            self._joint.add(part)


class Alone:
    """A topic of the rig of a process of its own.

    Args:
        own: at the rig's own key.
        alone: for processes of several rigs.
    """

    def __init__(self, own: Line, alone: AttendedLine) -> None:
        self._own, self._alone = own, alone

    def put(self, payload: bytes, mark: bytes) -> None:
        """Send."""
        self._own.put(payload, mark)
        if self._alone.is_heard:
            self._alone.put(payload, mark)
