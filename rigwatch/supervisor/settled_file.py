"""New content of a configuration, once it has stayed as it is between two looks.

Whoever saves a file may empty it first and write it in parts: a part may be valid, with sections
missing, and processes that run would be ended for it. Files are read again only if the kernel says
that they have changed: hundreds of rigs are looked at twice a second.
"""

import hashlib
from contextlib import suppress
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.file_marks import Mark, is_certain, mark_of
from rigwatch.wire.rig_config import rig_text
from rigwatch.wire.typed_files import files_of


class SettledFile:
    """A configuration's file, looked at from time to time.

    Args:
        path: the file.
        known: whether its present content counts as known; otherwise it is new at the second look.
    """

    def __init__(self, path: Path, *, known: bool = True) -> None:
        self._path = path
        self._marks: dict[Path, Mark] = {}
        self._seen = ""
        self._known = self._seen = self._hash() if known else ""

    def has_new_content(self) -> bool:
        """Whether the content is another than the known one, and that of the last look."""
        before, self._seen = self._seen, self._hash()
        if self._seen != before or self._seen in (self._known, ""):
            return False
        self._known = self._seen
        return True

    def _hash(self) -> str:
        """Hash of the content; "" while it cannot be read, as during a save."""
        if self._is_unchanged():
            return self._seen
        try:
            self._marks = self._certain_marks()
            return hashlib.sha256(_content(self._path)).hexdigest()
        except OSError:
            self._marks = {}
            return ""

    def _is_unchanged(self) -> bool:
        """Whether the files are certainly as they were when they were read."""
        with suppress(OSError):
            return bool(self._marks) and self._marks == {
                file: mark_of(file) for file in self._marks
            }
        return False

    def _certain_marks(self) -> dict[Path, Mark]:
        """Those of the files that are read next; none while they may change without a trace."""
        try:
            marks = {file: mark_of(file) for file in files_of(self._path)}
        except ConfigError:
            return {}
        return marks if all(map(is_certain, marks.values())) else {}


def _content(path: Path) -> bytes:
    """That of the file and its bases; of the file alone while they do not fit together."""
    try:
        return rig_text(path).encode()
    except ConfigError:
        return path.read_bytes()
