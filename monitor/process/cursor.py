"""The monitor's position in the stream, from which it continues after a kill.

Twenty bytes in a memory-mapped file: boot, seq, CRC-32. Writing never waits for the disk, and the
kernel keeps the data when the process is killed.

A process that writes to a page that its file can no longer take (the disk has become read-only, or
somebody has emptied the file) is killed by the kernel. So the kernel itself copies the bytes into
the page, out of a file in memory, and reports a failure.
"""

import contextlib
import errno
import mmap
import os
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

from rigwatch.wire.delivery import LARGEST_SEQ
from rigwatch.wire.errors import SessionError, reason_of

_POSITION = struct.Struct("<qq")
_CRC = struct.Struct("<I")
_SIZE = _POSITION.size + _CRC.size
MOST_AT_ONCE = 1000
"""Files whose positions are written by one call: the kernel takes 1024."""


class Cursor:
    """(boot, seq) of the last processed sample, in the file at `path`.

    Raises:
        SessionError: the file cannot be opened or created.
    """

    def __init__(self, path: Path | str) -> None:
        self._path = Path(path)
        try:
            self._page, self._file = _opened(self._path)
        except OSError as error:
            raise SessionError(f"{path}: cannot be opened: {reason_of(error)}") from error
        self._source = os.memfd_create("position", os.MFD_CLOEXEC)
        self._content = _content(self._path)

    def keep(self) -> None:
        """Put the position into its file again if that has been removed, emptied or was full."""
        try:
            there = self._path.stat()
            if there.st_ino == self._file and there.st_size >= _SIZE:
                return
        except OSError:
            pass
        with contextlib.suppress(OSError):
            fresh, self._file = _opened(self._path)
            self._page.close()
            self._page = fresh
            self._put(self._content)

    def read(self) -> tuple[int, int] | None:
        """The stored position; None if there is none."""
        found = stored_position(self._content)
        if found and not -1 <= found[1] <= LARGEST_SEQ:
            self.set_aside()
            return None
        return found

    def set_aside(self) -> None:
        """Move the invalid content to a file beside it for inspection, and start afresh."""
        with contextlib.suppress(OSError):
            self._path.with_name(f"{self._path.name}.set-aside").write_bytes(self._content)
        self._put(bytes(_SIZE))

    def write(self, boot: int, seq: int) -> None:
        """Record that sample `seq` of `boot` and all before it are processed."""
        self._put(_encoded(boot, seq))

    def _put(self, content: bytes) -> None:
        self._content = content
        os.pwrite(self._source, content, 0)
        try:
            os.preadv(self._source, [self._page], 0)
        except OSError:
            self._file = None  # `keep` opens it again

    @staticmethod
    def write_all(positions: "Sequence[tuple[Cursor, int, int]]") -> None:
        """The same for many: the kernel copies those of each thousand in one go."""
        for begin in range(0, len(positions), MOST_AT_ONCE):
            part = positions[begin : begin + MOST_AT_ONCE]
            for cursor, boot, seq in part:
                cursor._content = _encoded(boot, seq)
            source = part[0][0]._source
            os.pwrite(source, b"".join([cursor._content for cursor, _, _ in part]), 0)
            try:
                copied = os.preadv(source, [cursor._page for cursor, _, _ in part], 0)
            except OSError:
                copied = 0
            for cursor, _, _ in part[copied // _SIZE :]:
                cursor._put(cursor._content)  # says which of them fails

    def close(self) -> None:
        """Close the file."""
        self._page.close()
        os.close(self._source)


def stored_position(data: bytes) -> tuple[int, int] | None:
    """The (boot, seq) in a file's bytes; None if there is none, or they are damaged."""
    if len(data) != _SIZE or data[_POSITION.size :] == bytes(_CRC.size):
        return None
    if _CRC.unpack_from(data, _POSITION.size)[0] != zlib.crc32(data[: _POSITION.size]):
        return None
    boot, seq = _POSITION.unpack_from(data)
    return boot, seq


def _encoded(boot: int, seq: int) -> bytes:
    data = _POSITION.pack(boot, seq)
    return data + _CRC.pack(zlib.crc32(data))


def _opened(path: Path) -> tuple[mmap.mmap, int | None]:
    """The mapped file and its number.

    Plain memory and None on a full disk, where writing to a mapping kills the process, and on one
    that is read-only.
    """
    try:
        return _mapped(path)
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EROFS):
            raise
    return mmap.mmap(-1, _SIZE), None


def _content(path: Path) -> bytes:
    """The file's bytes; zeros where there are none."""
    with contextlib.suppress(OSError), path.open("rb") as opened:
        return opened.read(_SIZE).ljust(_SIZE, b"\0")
    return bytes(_SIZE)


def _mapped(path: Path) -> tuple[mmap.mmap, int]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as opened:
        opened.truncate(_SIZE)
        file = opened.fileno()
        os.posix_fallocate(file, 0, _SIZE)
        return mmap.mmap(file, _SIZE), os.fstat(file).st_ino
