"""Files that appear under their name only when they are complete.

A command that fails, is interrupted or killed leaves the file that was there before, or none.
"""

import contextlib
import glob
import math
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigwatch.wire.errors import RigwatchError, SessionError, reason_of

PART = ".part"
_NAME = re.compile(r".+\.(?P<process>\d+)\.part")
_START = 19
"""Place of a process's start in what /proc says of it behind its name, in ticks from the boot."""


@contextmanager
def new_file(
    path: Path, *, replace: bool = False, raises: type[RigwatchError] = SessionError
) -> Iterator[Path]:
    """A path beside `path` to write to: what stands there becomes `path` when the block ends.

    It is on the disk by then. A block that raises leaves nothing; what a killed process leaves
    beside `path` is removed when the file is written again, or by `rigwatch doctor --fix`.

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
        part = part_of(target)
    try:
        if part is not target:
            remove_left_behind(target)
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


def part_of(target: Path) -> Path:
    """Where this process writes what becomes `target`."""
    return target.with_name(f"{target.name}.{os.getpid()}{PART}")


def remove_left_behind(target: Path) -> None:
    """Remove what processes that are gone have begun to write in place of `target`."""
    for part in left_behind(target.parent, f"{glob.escape(target.name)}.*{PART}"):
        if part.name.removesuffix(PART).rpartition(".")[0] == target.name:
            part.unlink(missing_ok=True)


def left_behind(folder: Path, names: str = f"*{PART}") -> list[Path]:
    """Files in `folder` that processes began to write which are gone."""
    return sorted(part for part in folder.glob(names) if _is_left_behind(part))


def _is_left_behind(part: Path) -> bool:
    named = _NAME.fullmatch(part.name)
    if named is None or not part.is_file():
        return False
    process = int(named["process"])
    if process == os.getpid():
        return True
    try:
        return _began(process) > part.stat().st_mtime and not _has_open(process, part)
    except OSError:
        return False  # put in its place meanwhile


def _began(process: int) -> float:
    """When a process began as Unix time [s]: numbers come again. Infinite if it is gone."""
    try:
        told = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return math.inf
    ticks = int(told.rpartition(")")[2].split()[_START])
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME) + ticks / os.sysconf("SC_CLK_TCK")


def _has_open(process: int, part: Path) -> bool:
    """Whether it writes there: after a step of the clock it seems to have begun later."""
    found = Path(f"/proc/{process}/fd").glob("*")
    with contextlib.suppress(OSError):
        return str(part.resolve()) in {os.path.realpath(one) for one in found}
    return False
