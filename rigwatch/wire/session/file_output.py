"""Output of the MCAP writer: bytes wait in memory until they are committed to the disk."""

import os
from collections.abc import Callable
from pathlib import Path

from rigwatch.wire.errors import SessionError, reason_of


class FileOutput:
    """The stream below the MCAP writer: bytes wait until `commit` writes them to the disk.

    Args:
        path: the new file.
        sync: return from `commit` only once the bytes are on the disk.

    Raises:
        SessionError: the file exists or cannot be created.
    """

    def __init__(self, path: Path, sync: bool) -> None:
        self._path, self._sync = path, sync
        self._bytes = bytearray()
        self._sent = 0
        self.committed = 0
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError:
            raise SessionError(f"{path}: the file exists already and is not overwritten") from None
        except OSError as error:
            raise SessionError(f"{path}: cannot be written: {reason_of(error)}") from error
        self.closed = False
        self._had_name = self._has_name()

    @property
    def waiting(self) -> int:
        """Number of bytes that are not in the file yet."""
        return len(self._bytes)

    def write(self, data: bytes) -> int:
        """Append bytes; they wait until `commit`."""
        self._bytes += data
        return len(data)

    def tell(self) -> int:
        """Position at the end of all bytes."""
        return self.committed + self._sent + len(self._bytes)

    def flush(self) -> None:
        """Do nothing: the MCAP writer flushes more often than chunks are complete."""

    def commit(self) -> None:
        """Write the waiting bytes to the disk.

        Raises:
            SessionError: they cannot be written, or somebody has removed the file; it is as before.
        """
        self.send()
        self.settle()

    def send(self) -> None:
        """Write the waiting bytes to the file; they are on the disk after `settle`.

        Raises:
            SessionError: as in `commit`.
        """
        if self._had_name and not self._has_name():
            raise SessionError(f"{self._path}: cannot be written: it has been removed")
        self._or_as_before(self._write_all)

    def settle(self) -> None:
        """Wait until what was sent is on the disk.

        Raises:
            SessionError: it never will be; the file is as before what was sent.
        """
        if self._sync and self._sent:
            self._or_as_before(lambda: os.fsync(self._descriptor))
        self.committed += self._sent
        self._sent = 0

    def _or_as_before(self, work: Callable[[], None]) -> None:
        try:
            work()
        except OSError as error:
            self._roll_back()
            raise SessionError(f"{self._path}: cannot be written: {reason_of(error)}") from error

    def _write_all(self) -> None:
        view = memoryview(bytes(self._bytes))
        done = 0
        while done < len(view):
            done += os.write(self._descriptor, view[done:])
        self._bytes.clear()
        self._sent += done

    def _has_name(self) -> bool:
        """Whether it is in a folder: what is written to a removed file is lost without an error."""
        return os.fstat(self._descriptor).st_nlink > 0

    def _roll_back(self) -> None:
        """Remove what is not committed, as its messages will be in the next segment."""
        self._sent = 0
        try:
            os.ftruncate(self._descriptor, self.committed)
            os.lseek(self._descriptor, self.committed, os.SEEK_SET)
        except OSError:
            pass

    def close(self) -> None:
        """Close the file; waiting bytes are lost."""
        if not self.closed:
            self.closed = True
            os.close(self._descriptor)
