"""One writer of an index at a time: two would forget what the other has catalogued."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigwatch.archive.layout import INDEX
from rigwatch.archive.store import Store
from rigwatch.wire.errors import ArchiveError, reason_of

LOCK = f"{INDEX}/lock"


@contextmanager
def one_writer(store: Store) -> Iterator[None]:
    """Hold the lock of a folder's index; the kernel frees it when the process ends in any way.

    An object store has no locks: there the catalogue is compared before it is written.

    Raises:
        ArchiveError: another process holds it, or the folder cannot be written.
    """
    if not store.is_local:
        yield
        return
    path = Path(store.path(LOCK))
    try:
        path.parent.mkdir(exist_ok=True)
        file = path.open("w")
    except OSError as error:
        raise ArchiveError(f"{path}: cannot be written: {reason_of(error)}") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise other_writer(store) from None
        yield


def other_writer(store: Store) -> ArchiveError:
    """The error of a writer that is not alone."""
    return ArchiveError(
        f"{store.url}: another process writes its index, expected one at a time:"
        " run this again when the other has ended"
    )
