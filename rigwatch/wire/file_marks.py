"""Whether files and folders have changed since they were read, by what the kernel notes of them."""

import time
from pathlib import Path

CERTAIN_AFTER_NS = 2_000_000_000
"""Age of a change after which a further one has another time on any file system [ns]."""
Mark = tuple[int, int, int, int, int]
"""Disk, number, size, and times of change of a file or folder [ns]."""


def mark_of(path: Path) -> Mark:
    """The mark of a file or folder, taken before it is read.

    Raises:
        OSError: there is none.
    """
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def is_certain(mark: Mark) -> bool:
    """Whether a change from now on will show; it may not, so soon after another one."""
    return time.time_ns() - max(mark[-2:]) > CERTAIN_AFTER_NS
