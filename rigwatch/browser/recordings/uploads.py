"""Files that are uploaded and wait to be imported: few of them, none from a server that is gone."""

import contextlib
import fcntl
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MOST_WAITING = 8
"""Most files that wait; with a further one the oldest goes."""


_LOCK = "lock"


@contextmanager
def kept_uploads(folder: Path) -> Iterator[None]:
    """Keep the folder of uploads while a server runs.

    What servers left that are gone, killed ones too, is removed, unless another one serves the
    folder now. The lock is the kernel's, which frees it with the process.
    """
    try:
        folder.mkdir(exist_ok=True)
        # A lock of POSIX, as workers that outlive a killed server would inherit another.
        file = (folder / _LOCK).open("a+b")
    except OSError:  # a folder that is only read takes no uploads
        yield
        return
    with file:
        with contextlib.suppress(OSError):  # another server holds it
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for left in _waiting(folder):
                shutil.rmtree(left, ignore_errors=True)
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.lockf(file, fcntl.LOCK_SH)
        yield


def new_upload(folder: Path) -> Path:
    """A new folder for one upload; of those that wait the oldest make room."""
    folder.mkdir(exist_ok=True)
    waiting = sorted(_waiting(folder), key=_age)
    for oldest in waiting[: max(0, len(waiting) - MOST_WAITING + 1)]:
        shutil.rmtree(oldest, ignore_errors=True)
    made = folder / secrets.token_hex(6)
    made.mkdir()
    return made


def _waiting(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.name != _LOCK]


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
