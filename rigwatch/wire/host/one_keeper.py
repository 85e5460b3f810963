"""What one process at a time may keep: a second would undo, double or remove what the first keeps.

The lock is the kernel's and ends with its process in any way. It is one of POSIX, which what a
killed process leaves behind does not inherit. Two traits of these locks are provided for here:
closing any descriptor of the file frees the lock, so nothing else opens the file for longer than
the lock is held; and its own process may take it twice, so who holds what within it is noted.
"""

import errno
import fcntl
import logging
import os
import struct
import threading
from pathlib import Path

from rigwatch.wire.errors import HeldError, SessionError, reason_of

_log = logging.getLogger(__name__)

_LOCK = struct.Struct("hhqqi")
"""Kind, origin, start, length and holder of a lock, as the kernel tells them."""
_File = tuple[int, int]
_here: set[_File] = set()
"""Device and number of the files that this process holds."""
_noting = threading.RLock()


class Hold:
    """A lock, from `take` until it is given up or the process ends.

    Args:
        path: the lock's file, created if missing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._opened: tuple[int, _File] | None = None
        self._said = False

    def take(self) -> None:
        """Take the lock; on a file system without locks it is logged that there is none.

        Raises:
            HeldError: somebody has it already.
            OSError: the file cannot be made.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with _noting:
            # Not opened where this process holds it: closing it again would free it.
            if _identity(self._path) in _here:
                raise HeldError(f"process {os.getpid()}")
            opened = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.lockf(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno in (errno.EACCES, errno.EAGAIN):
                    holder = _holder(opened)
                    os.close(opened)
                    raise HeldError(holder) from None
                self.say_none(error)
            status = os.fstat(opened)
            self._opened = opened, (status.st_dev, status.st_ino)
            _here.add(self._opened[1])

    def is_kept(self) -> bool:
        """Whether the lock is held, and others who want it come to the same file."""
        return self._opened is not None and _identity(self._path) == self._opened[1]

    def say_none(self, error: OSError) -> None:
        """Log once that there is no lock."""
        if not self._said:
            self._said = True
            why = f"{self._path}: no lock can be had: {reason_of(error)}"
            _log.warning("%s; a second process that keeps the same would not be noticed", why)

    def give_up(self) -> None:
        """Free the lock, if it is held."""
        with _noting:
            if self._opened is not None:
                os.close(self._opened[0])
                _here.discard(self._opened[1])
                self._opened = None


class Kept:
    """What this process alone keeps, though it goes on where no lock can be had: that is logged.

    Args:
        path: the lock's file, created if missing.
        kept: what the lock is for, in the error.

    Raises:
        SessionError: another process holds it.
    """

    def __init__(self, path: Path, kept: str) -> None:
        self._hold, self._kept = Hold(path), kept
        self.check()

    def check(self) -> None:
        """Take the lock if it is not held: the disk was full, or somebody has removed its file.

        Raises:
            SessionError: another process holds it by now.
        """
        if self._hold.is_kept():
            return
        self._hold.give_up()
        try:
            self._hold.take()
        except OSError as error:
            self._hold.say_none(error)
        except HeldError as error:
            raise SessionError(
                f"{self._kept}: {error} keeps it already, expected one at a time"
            ) from None

    def give_up(self) -> None:
        """Let others keep it."""
        self._hold.give_up()


def _identity(path: Path) -> _File | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _holder(file: int) -> str:
    asked = _LOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
    holder = _LOCK.unpack(fcntl.fcntl(file, fcntl.F_GETLK, asked))[-1]
    return f"process {holder}" if holder > 0 else "another process"
