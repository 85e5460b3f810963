"""Free space on a disk."""

import os
from collections.abc import Iterator
from itertools import chain
from pathlib import Path


def free_share(folder: Path) -> float:
    """Share of the disk of `folder` that this process can still fill, 0 to 1; NaN if unknown.

    Blocks that the file system keeps for its administrator count neither as free nor as the
    disk's, as in `df`. If the folder does not exist yet, its nearest existing parent is used.
    """
    for place in chain((folder,), _above(folder)):
        try:
            found = os.statvfs(place)
        except OSError:
            continue
        usable = found.f_blocks - found.f_bfree + found.f_bavail
        return found.f_bavail / usable if usable else float("nan")
    return float("nan")


def _above(folder: Path) -> Iterator[Path]:
    """The parents, which are looked for only where they are needed."""
    yield from folder.absolute().parents
