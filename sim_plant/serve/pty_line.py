"""A serial line made of a pseudo terminal: raw, never waiting for its reader, and pluggable.

The device holds the master's end. A symbolic link gives the other end a stable name. While no
process has the line open its bytes are lost, as on a wire.
"""

import contextlib
import os
import pty
import select
import tty
from pathlib import Path

from rigwatch.wire.errors import DeviceError, reason_of


class PtyLine:
    """The device's end of a line.

    Args:
        link: path of the symbolic link to the reader's end; an older link is replaced.

    Attributes:
        dropped: bytes lost for lack of a reader.
    """

    def __init__(self, link: Path | str) -> None:
        self.link = Path(link)
        self.dropped = 0
        self._master: int | None = None
        self._target = ""

    @property
    def plugged(self) -> bool:
        """Whether the line exists now."""
        return self._master is not None

    def fileno(self) -> int:
        """The master's descriptor, -1 while unplugged."""
        return -1 if self._master is None else self._master

    def plug(self, link: Path | str | None = None) -> None:
        """Create the line, under another name if `link` is given.

        Raises:
            DeviceError: the link cannot be created.
        """
        self.unplug()
        self.link = Path(link or self.link)
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self._make_link(os.ttyname(slave))
        os.close(slave)

    def unplug(self) -> None:
        """Remove the line; readers see it close."""
        if self._master is not None:
            os.close(self._master)
            self._master = None
            self._remove_link()

    def heard(self) -> bool:
        """Whether a process has the other end open."""
        if self._master is None:
            return False
        poll = select.poll()
        poll.register(self._master, select.POLLOUT)
        return not any(events & select.POLLHUP for _, events in poll.poll(0))

    def write(self, data: bytes) -> None:
        """Send as much as fits; count the rest as lost. Never waits."""
        sent = 0
        if self.heard():
            with contextlib.suppress(OSError):
                sent = os.write(self.fileno(), data)
        self.dropped += len(data) - sent

    def read(self) -> bytes:
        """The bytes received from the other end, empty if none."""
        try:
            return os.read(self.fileno(), 4096)
        except OSError:
            return b""

    def _remove_link(self) -> None:
        """Only this line's link: another plant may have replaced it."""
        with contextlib.suppress(OSError):
            if str(self.link.readlink()) == self._target:
                self.link.unlink()

    def _make_link(self, target: str) -> None:
        self._target = target
        try:
            if self.link.is_symlink():
                self.link.unlink()
            self.link.symlink_to(target)
        except OSError as error:
            self.unplug()
            raise DeviceError(
                f"{self.link}: cannot link the line here: {reason_of(error)}"
            ) from error

    def __enter__(self) -> "PtyLine":
        self.plug()
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()
