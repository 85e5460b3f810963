"""Free space on a disk."""

import shutil
from pathlib import Path


def free_share(folder: Path) -> float:
    """Share of the disk of `folder` that this process can still fill, 0 to 1; NaN if unknown.

    Blocks that the file system keeps for its administrator count neither as free nor as the
    disk's, as in `df`. If the folder does not exist yet, its nearest existing parent is used.
    """
    for place in (folder, *folder.absolute().parents):
        try:
            found = shutil.disk_usage(place)
        except OSError:
            continue
        usable = found.used + found.free
        return found.free / usable if usable else float("nan")
    return float("nan")
