"""The folder of one demonstration: a second one would take its alarms, model and configuration."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path

from rigwatch.wire.errors import HeldError, RigwatchError, reason_of
from rigwatch.wire.host import Hold

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
    for folder in [wanted] if wanted else chain([USUAL], further):
        try:
            lock = _held(folder)
        except HeldError as error:
            if wanted:
                text = f"another demonstration runs there ({error}), expected a free folder"
                raise RigwatchError(f"{wanted}: {text}") from None
            continue
        try:
            yield folder
        finally:
            lock.give_up()
        return


def _held(folder: Path) -> Hold:
    lock = Hold(folder / LOCK)
    try:
        lock.take()
    except OSError as error:
        raise RigwatchError(f"{folder}: cannot be written: {reason_of(error)}") from None
    return lock
