"""The folder of one demonstration: a second one would take its alarms, model and configuration."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import IO

from rigwatch.wire.errors import RigwatchError, reason_of

USUAL = Path("demo-session")
LOCK = "lock"


@contextmanager
def own_folder(wanted: Path | None) -> Iterator[Path]:
    """A folder that no other demonstration uses while this lasts, however that one may end.

    Args:
        wanted: the folder; None for the usual one, or a further one beside it while it is in use.

    Raises:
        RigwatchError: the wanted folder is in use, or cannot be written.
    """
    further = (USUAL.with_name(f"{USUAL.name}-{number}") for number in count(2))
    folders = [wanted] if wanted else chain([USUAL], further)
    found = ((folder, lock) for folder in folders if (lock := _held(folder)) is not None)
    folder, lock = next(found, (None, None))
    if folder is None or lock is None:
        raise RigwatchError(f"{wanted}: another demonstration runs there, expected a free folder")
    with lock:
        yield folder


def _held(folder: Path) -> IO[str] | None:
    """The folder's lock, which the kernel frees with this process; None if another holds it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / LOCK).open("w", encoding="utf-8")
    except OSError as error:
        raise RigwatchError(f"{folder}: cannot be written: {reason_of(error)}") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        return None
    return lock
