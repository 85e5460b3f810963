"""Files that a new study puts into its folder: what was there before is never changed."""

import fcntl
import filecmp
import os
import shutil
from pathlib import Path
from types import TracebackType

from rigwatch.wire.errors import ModelError


class NewFiles:
    """The files that a step makes in a folder; those of a step that fails are removed again.

    Meanwhile no other process does: the one that fails would remove the other's files.

    Args:
        folder: created if it does not exist.

    Raises:
        ModelError: another process makes files there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._made: list[Path] = []
        self._is_new = False
        self._lock = -1

    def __enter__(self) -> "NewFiles":
        try:
            self.folder.mkdir(parents=True)
            self._is_new = True
        except FileExistsError:
            self.folder.mkdir(exist_ok=True)  # what is no folder is refused
        self._lock = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._lock)
            found = "found another process that makes a study there"
            raise ModelError(f"{self.folder}: {found}, expected a folder of its own") from None
        except OSError:
            pass  # a file system without locks
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is not None:
                self._remove()
        finally:
            os.close(self._lock)

    def _remove(self) -> None:
        for path in self._made:
            path.unlink(missing_ok=True)
        if self._is_new:
            shutil.rmtree(self.folder, ignore_errors=True)

    def to_write(self, name: str) -> Path:
        """The path of a file that the caller writes.

        Raises:
            ModelError: there is a file of that name.
        """
        target = self.folder / name
        if target.exists():
            raise ModelError(f"{target}: the file exists already and is not overwritten")
        self._made.append(target)
        return target

    def copied(self, source: Path) -> Path:
        """A file in the folder with the content of `source`, which may be that very file.

        Raises:
            ModelError: there is another file of that name, or `source` cannot be read.
        """
        target = self.folder / source.name
        if not source.is_file():
            raise ModelError(f"{source}: found no such file")
        if target.exists() and filecmp.cmp(source, target, shallow=False):
            return target
        shutil.copyfile(source, self.to_write(source.name))
        return target
