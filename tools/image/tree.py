"""A folder that becomes the root of an image: what is placed in it lies where it lies here."""

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path


class Tree:
    """Places files of this machine under their own paths, symbolic links on the way included.

    Files are linked where the file system allows, so an image beside its source takes no room.

    Args:
        root: an empty folder, or one that does not exist.

    Attributes:
        files: what has been placed, without links and folders.

    Raises:
        FileExistsError: there is something in it.
    """

    def __init__(self, root: Path) -> None:
        root.mkdir(parents=True, exist_ok=True)
        if any(root.iterdir()):
            raise FileExistsError(f"{root} is not empty")
        self.root = root
        self.files: list[Path] = []
        self._folders: dict[Path, Path] = {}

    def place(self, path: Path, wanted: Callable[[Path], bool] = lambda _: True) -> Path:
        """Place a file, or a folder with all that is wanted of it; returns the path without links.

        Raises:
            FileNotFoundError: there is no such file.
        """
        place = self._place_way(path)
        if not place.is_dir():
            self._place_file(place)
            return place
        self.make(place)
        for inside in filter(wanted, sorted(place.iterdir())):
            self.place(inside, wanted)
        return place

    def make(self, folder: Path, mode: int = 0o755) -> None:
        """Make a folder, unless it is there."""
        at = self.within(folder)
        if not at.is_dir():
            at.mkdir(parents=True)
            at.chmod(mode)

    def write(self, path: Path, text: str) -> None:
        """Write a file that this machine has not, or has with other content."""
        self.make(path.parent)
        self.within(path).write_text(text, encoding="utf-8")

    def within(self, path: Path) -> Path:
        """Where in the tree an absolute path lies."""
        return Path(f"{self.root}{path}")

    def _place_way(self, path: Path) -> Path:
        """Place the folders and links that a path goes through; returns where it leads."""
        if path.parent == path:
            return path
        if path.name == "..":
            return self._place_folder(path.parent).parent
        at = self._place_folder(path.parent) / path.name
        if not at.is_symlink():
            return at
        self._place_link(at)
        return self._place_way(at.parent / at.readlink())

    def _place_folder(self, path: Path) -> Path:
        """The same for a folder, which is made."""
        if path not in self._folders:
            self._folders[path] = self._place_way(path)
            self.make(self._folders[path])
        return self._folders[path]

    def _place_link(self, path: Path) -> None:
        at = self.within(path)
        if not at.is_symlink():
            at.symlink_to(path.readlink())

    def _place_file(self, path: Path) -> None:
        at = self.within(path)
        if at.exists():
            return
        try:
            os.link(path, at)
        except OSError as error:
            if error.errno not in (errno.EXDEV, errno.EPERM, errno.EMLINK):
                raise
            shutil.copy2(path, at)
        self.files.append(path)
