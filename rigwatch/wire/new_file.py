"""Files that appear under their name only when they are complete.

A command that fails, is interrupted or killed leaves the file that was there before, or none.
"""

import glob
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigwatch.wire.errors import RigwatchError, SessionError, reason_of

PART = ".part"


@contextmanager
def new_file(
    path: Path, *, replace: bool = False, raises: type[RigwatchError] = SessionError
) -> Iterator[Path]:
    """A path beside `path` to write to: what stands there becomes `path` when the block ends.

    It is on the disk by then. A block that raises leaves nothing; what a killed process leaves
    beside `path` is removed when the file is written again.

    Args:
        path: the file.
        replace: a file that exists is replaced, else refused. A device or pipe is written to.
        raises: kind of the errors.

    Raises:
        RigwatchError: the file exists, or it cannot be written.
    """
    target = Path(os.path.realpath(path))
    if os.path.lexists(target) and not replace:
        raise raises(f"{path}: the file exists already and is not overwritten")
    if target.exists() and not target.is_file():
        part = target
    else:
        part = target.with_name(f"{target.name}.{os.getpid()}{PART}")
    try:
        if part is not target:
            _remove_left_behind(target)
        yield part
        if part is not target:
            _put(part, target, replace=replace)
    except RigwatchError as error:
        error.args = (str(error).replace(str(part), str(path)),)
        raise
    except FileExistsError:
        raise raises(f"{path}: the file exists already and is not overwritten") from None
    except OSError as error:
        raise raises(f"{path}: cannot be written: {reason_of(error)}") from error
    finally:
        if part is not target:
            part.unlink(missing_ok=True)


def write_new(
    path: Path, text: str, *, replace: bool = False, raises: type[RigwatchError] = SessionError
) -> None:
    """Write a text file as `new_file` does.

    Raises:
        RigwatchError: the file exists, or it cannot be written.
    """
    with new_file(path, replace=replace, raises=raises) as part:
        part.write_text(text, encoding="utf-8")


def sync(path: Path) -> None:
    """Return once a file's content, or the names of a folder's files, survive a power cut."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _put(part: Path, target: Path, *, replace: bool) -> None:
    sync(part)
    if not replace:
        _name_anew(part, target)
    else:
        if target.exists():
            shutil.copymode(target, part)
        part.replace(target)
    sync(target.parent)


def _name_anew(part: Path, target: Path) -> None:
    """Rename without replacing what another process has written in the meantime."""
    try:
        os.link(part, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links, as of a memory card
        if target.exists():
            raise FileExistsError from None
        part.rename(target)


def _remove_left_behind(target: Path) -> None:
    """Remove what processes that are gone have begun to write."""
    for part in target.parent.glob(f"{glob.escape(target.name)}.*{PART}"):
        number = part.name.removeprefix(f"{target.name}.").removesuffix(PART)
        if number.isdecimal() and not _is_running(int(number)):
            part.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return process != os.getpid()
