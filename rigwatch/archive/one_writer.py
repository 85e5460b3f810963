"""One writer of an index at a time: two would forget what the other has catalogued."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigwatch.archive.layout import INDEX
from rigwatch.archive.store import Store
from rigwatch.wire.errors import ArchiveError, HeldError, reason_of
from rigwatch.wire.host import Hold

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
    lock = Hold(path)
    try:
        lock.take()
    except OSError as error:
        raise ArchiveError(f"{path}: cannot be written: {reason_of(error)}") from None
    except HeldError as error:
        raise other_writer(store, str(error)) from None
    try:
        yield
    finally:
        lock.give_up()


def other_writer(store: Store, who: str = "another process") -> ArchiveError:
    """The error of a writer that is not alone."""
    return ArchiveError(
        f"{store.url}: {who} writes its index, expected one at a time:"
        " run this again when the other has ended"
    )
