"""Paths: everything that a request can name is inside one folder, with links resolved."""

import re
from dataclasses import dataclass
from pathlib import Path

from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.study import FILE, Study, open_study

RECORDINGS = "recordings"
MODELS = "models"
UPLOADS = ".uploads"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")


class PlaceError(RigwatchError):
    """A name that is not inside the folder."""


@dataclass(frozen=True)
class Places:
    """The served folder.

    Attributes:
        root: its path, with links resolved.
    """

    root: Path

    def inside(self, name: str) -> Path:
        """The path of a name under the root.

        Raises:
            PlaceError: it leads outside the root, by dots or by a link.
        """
        try:
            found = (self.root / name).resolve()
            found.exists()  # a name can be too long, or not be one in the file system's encoding
        except (ValueError, OSError):
            raise PlaceError(f"{name!r}: not a valid file name") from None
        if not found.is_relative_to(self.root):
            raise PlaceError(f"{name}: lies outside {self.root}, expected a path inside it")
        return found

    def study(self, name: str) -> Path:
        """The folder of a study with all its files under the root.

        Raises:
            PlaceError: there is none, or one of its files is outside.
        """
        folder = self.inside(name)
        if not (folder / FILE).is_file():
            raise PlaceError(f"{name}: no such study")
        self.inside(f"{name}/{FILE}")
        return folder

    def checked(self, name: str) -> Path:
        """The same, after checking every file that the study names.

        Raises:
            RigwatchError: the study cannot be opened, or one of its files is outside.
        """
        folder = self.study(name)
        for path in _files(open_study(folder)):
            if not path.resolve().is_relative_to(self.root):
                raise PlaceError(
                    f"{name}: names {path}, which lies outside {self.root}; expected all of its"
                    " files in the folder that the workbench was started with"
                )
        return folder

    def new(self, name: str, below: str = "") -> Path:
        """The path for a new file or folder.

        Raises:
            PlaceError: it is not a plain name.
        """
        if not _NAME.fullmatch(name) or ".." in name:
            raise PlaceError(f"{name!r}: expected a name of letters, digits, '.', '_' and '-'")
        return self.inside(f"{below}/{name}" if below else name)

    def relative(self, path: Path) -> str:
        """A path relative to the root, as used in pages."""
        return path.resolve().relative_to(self.root).as_posix()


def _files(study: Study) -> list[Path]:
    own = [study.folder / name for name in study.file.effect_files]
    if study.file.model.endswith(".toml"):
        own.append(study.folder / study.file.model)
    return [*study.sessions().values(), *own]
