"""Files that a new study puts into its folder: what was there before is never changed."""

import filecmp
import shutil
from pathlib import Path
from types import TracebackType

from rigwatch.wire.errors import ModelError


class NewFiles:
    """The files that a step makes in a folder; those of a step that fails are removed again.

    Args:
        folder: created if it does not exist.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._made: list[Path] = []
        self._is_new = not folder.exists()

    def __enter__(self) -> "NewFiles":
        self.folder.mkdir(parents=True, exist_ok=True)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            return
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
