"""How far the monitor has come, kept so that a killed monitor's successor continues from there.

Twenty bytes in a file that is mapped into memory: boot, seq, CRC-32. Writing costs no system call,
and the kernel keeps what was written when the process is killed.
"""

import contextlib
import errno
import mmap
import os
import struct
import zlib
from pathlib import Path

from rigwatch.wire.delivery import LARGEST_SEQ
from rigwatch.wire.errors import SessionError

_POSITION = struct.Struct("<qq")
_CRC = struct.Struct("<I")
_SIZE = _POSITION.size + _CRC.size


class Cursor:
    """(boot, seq) of the last sample dealt with, in the file at `path`.

    Raises:
        SessionError: the file cannot be opened or made.
    """

    def __init__(self, path: Path | str) -> None:
        self._path = Path(path)
        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            with Path(path).open("a+b") as file:
                file.truncate(_SIZE)
                self._bytes = _mapped(file.fileno())
        except OSError as error:
            raise SessionError(f"{path}: cannot be opened: {error.strerror}") from error

    def read(self) -> tuple[int, int] | None:
        """The position that stands in the file; None where none does."""
        data = self._bytes[:]
        (crc,) = _CRC.unpack_from(data, _POSITION.size)
        if crc == 0 or crc != zlib.crc32(data[: _POSITION.size]):
            return None
        boot, seq = _POSITION.unpack_from(data)
        if not -1 <= seq <= LARGEST_SEQ:
            self.set_aside()
            return None
        return boot, seq

    def set_aside(self) -> None:
        """Keep what stands in the file beside it for whoever looks, and begin anew."""
        with contextlib.suppress(OSError):
            self._path.with_name(f"{self._path.name}.set-aside").write_bytes(self._bytes[:])
        self._bytes[:] = bytes(_SIZE)

    def write(self, boot: int, seq: int) -> None:
        """The sample `seq` of `boot` and all before it are dealt with."""
        data = _POSITION.pack(boot, seq)
        self._bytes[:] = data + _CRC.pack(zlib.crc32(data))

    def close(self) -> None:
        """Close the file."""
        self._bytes.close()


def _mapped(file: int) -> mmap.mmap:
    """The file in memory, or memory alone: a write without its place on a full disk would kill."""
    try:
        os.posix_fallocate(file, 0, _SIZE)
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        return mmap.mmap(-1, _SIZE)
    return mmap.mmap(file, _SIZE)
