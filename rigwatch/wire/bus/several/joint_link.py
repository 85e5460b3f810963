"""What the rigs of a process share of a link: their joined messages, and when they are sent."""

import threading
from collections.abc import Callable

from rigwatch.wire.bus.several.burst import Burst
from rigwatch.wire.bus.several.joint_message import joint_key
from rigwatch.wire.bus.several.joint_receiver import Following, JointReceiver
from rigwatch.wire.bus.several.joint_sender import AttendedLine, JointSender


class JointLink:
    """The topics of all rigs over one link.

    Args:
        line: makes a line that sends at a key.
        channel: listens at a key.

    Attributes:
        burst: sends what rigs put meanwhile.
    """

    def __init__(
        self, line: Callable[[str], AttendedLine], channel: Callable[[str], Following]
    ) -> None:
        self.burst = Burst()
        self._line, self._channel = line, channel
        self._senders: dict[str, JointSender] = {}
        self._receivers: dict[str, JointReceiver] = {}
        self._lock = threading.Lock()

    def sender(self, key: str) -> JointSender:
        """Sends a topic; `key` is that within a rig."""
        with self._lock:
            if key not in self._senders:
                self._senders[key] = JointSender(self._line(joint_key(key)), self.burst)
            return self._senders[key]

    def collect(self) -> None:
        """Hand out what has come of all topics, but for what rows take."""
        for receiver in tuple(self._receivers.values()):
            receiver.distribute()

    def receiver(self, key: str) -> JointReceiver:
        """Receives a topic."""
        with self._lock:
            if key not in self._receivers:
                self._receivers[key] = JointReceiver(self._channel(joint_key(key)))
            return self._receivers[key]
