"""The sessions in a folder by rig, listed again only when the folder has changed.

Each rig of a folder looks for its sessions once a minute, and a year of hundreds of rigs is a
hundred thousand of them.
"""

import os
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from rigwatch.wire.file_marks import Mark, is_certain, mark_of

_NAME = re.compile(r"(.+)-\d{8}T\d{6}Z(?:-\d+)?", re.DOTALL)
_known: dict[Path, tuple[Mark, Mapping[str, Sequence[str]]]] = {}
_listing = threading.Lock()


def sessions_of(root: Path, rig: str) -> Iterator[Path]:
    """Folders of the rig's sessions, without those of a rig whose id begins with this one's."""
    return (root / name for name in _listed(root).get(rig, ()))


def _listed(root: Path) -> Mapping[str, Sequence[str]]:
    """The names of the sessions of each rig; none of a folder that cannot be read."""
    with _listing, suppress(OSError):
        mark = mark_of(root)
        if root in _known and _known[root][0] == mark:
            return _known[root][1]
        _known.pop(root, None)
        found: dict[str, list[str]] = {}
        for name in os.listdir(root):  # noqa: PTH208 (names, without a path for each)
            if named := _NAME.fullmatch(name):
                found.setdefault(named[1], []).append(name)
        if is_certain(mark):
            _known[root] = mark, found
        return found
    return {}
