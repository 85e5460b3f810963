"""What one process at a time may keep: a second would undo, double or remove what the first keeps.

The lock is on a file of its own, which nothing else opens, and ends with its process in any way.
"""

import errno
import fcntl
import os
import struct
from collections.abc import Callable
from pathlib import Path

from rigwatch.wire.errors import SessionError

_LOCK = struct.Struct("hhqqi")
"""Kind, origin, start, length and holder of a lock, as the kernel tells them."""


def hold(path: Path, kept: str) -> Callable[[], None]:
    """Take the lock at `path`; call what is returned to give it up.

    Where no lock can be had, as on a full disk, there is none.

    Args:
        path: the lock's file, created if missing.
        kept: what the lock is for, in the error.

    Raises:
        SessionError: another process holds it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError:
        return lambda: None
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN):
            holder = _holder(file)
            os.close(file)
            raise SessionError(
                f"{kept}: {holder} keeps it already, expected one at a time"
            ) from None
    return lambda: os.close(file)


def _holder(file: int) -> str:
    asked = _LOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
    holder = _LOCK.unpack(fcntl.fcntl(file, fcntl.F_GETLK, asked))[-1]
    return f"process {holder}" if holder > 0 else "another process"
