"""Output of the MCAP writer: bytes wait in memory until they are committed to the disk."""

import os
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
        """Number of bytes not committed yet."""
        return len(self._bytes)

    def write(self, data: bytes) -> int:
        """Append bytes; they wait until `commit`."""
        self._bytes += data
        return len(data)

    def tell(self) -> int:
        """Position at the end of all bytes."""
        return self.committed + len(self._bytes)

    def flush(self) -> None:
        """Do nothing: the MCAP writer flushes more often than chunks are complete."""

    def commit(self) -> None:
        """Write the waiting bytes to the disk.

        Raises:
            SessionError: they cannot be written, or somebody has removed the file; it is as before.
        """
        if self._had_name and not self._has_name():
            raise SessionError(f"{self._path}: cannot be written: it has been removed")
        try:
            self._write_all()
        except OSError as error:
            self._roll_back()
            raise SessionError(f"{self._path}: cannot be written: {reason_of(error)}") from error

    def _write_all(self) -> None:
        view = memoryview(bytes(self._bytes))
        done = 0
        while done < len(view):
            done += os.write(self._descriptor, view[done:])
        if self._sync:
            os.fsync(self._descriptor)
        self.committed += done
        self._bytes.clear()

    def _has_name(self) -> bool:
        """Whether it is in a folder: what is written to a removed file is lost without an error."""
        return os.fstat(self._descriptor).st_nlink > 0

    def _roll_back(self) -> None:
        """Remove a partly written chunk, as its messages will be in the next segment."""
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
