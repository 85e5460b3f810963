"""New content of a configuration, once it has stayed as it is between two looks.

Whoever saves a file may empty it first and write it in parts: a part may be valid, with sections
missing, and processes that run would be ended for it.
"""

import hashlib
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.rig_config import rig_text


class SettledFile:
    """A configuration's file, looked at from time to time.

    Args:
        path: the file.
        known: whether its present content counts as known; otherwise it is new at the second look.
    """

    def __init__(self, path: Path, *, known: bool = True) -> None:
        self._path = path
        self._known = self._seen = hash_of(path) if known else ""

    def has_new_content(self) -> bool:
        """Whether the content is another than the known one, and that of the last look."""
        before, self._seen = self._seen, hash_of(self._path)
        if self._seen != before or self._seen in (self._known, ""):
            return False
        self._known = self._seen
        return True


def hash_of(path: Path) -> str:
    """Hash of a configuration's content; "" while it cannot be read, as during a save."""
    try:
        return hashlib.sha256(_content(path)).hexdigest()
    except OSError:
        return ""


def _content(path: Path) -> bytes:
    """That of the file and its bases; of the file alone while they do not fit together."""
    try:
        return rig_text(path).encode()
    except ConfigError:
        return path.read_bytes()
