"""The secret of a rig without keys: a file that only the account of the rig can read.

    monitor, witness ──make──▶ commands.secret (mode 0600) ◀──read── a command of the same account

It authenticates the account, not a person. The first process that verifies commands makes it, and
it stays over restarts.
"""

import contextlib
import os
import secrets
import stat
from pathlib import Path

from rigwatch.wire.errors import KeysError, reason_of
from rigwatch.wire.rig_config import SecuritySection

NAME = "commands.secret"
LENGTH = 64
"""Characters of a secret: 256 bits, hexadecimal."""
_FOR_OTHERS = 0o027
"""Permissions that must not be set: the group may only read, others have none."""


def secret_file(security: SecuritySection) -> Path:
    """Path of the secret: the configuration's, otherwise in the account's state folder.

    Raises:
        KeysError: the account has no home folder.
    """
    if security.secret:
        return Path(security.secret)
    state = Path(os.environ.get("XDG_STATE_HOME", ""))
    try:
        folder = state if state.is_absolute() else Path.home() / ".local" / "state"
    except RuntimeError:
        raise KeysError(
            "bus.security.secret: found nothing and no home folder, expected a path"
        ) from None
    return folder / "rigwatch" / NAME


def read_secret(path: Path) -> bytes:
    """The secret.

    Raises:
        KeysError: it cannot be read, or is none.
    """
    return _read(path)[0]


def own_secret(path: Path) -> bytes:
    """The secret of this process's account, made if there is none.

    Raises:
        KeysError: it cannot be made or read, or other accounts can read or may have made it.
    """
    if not path.is_symlink() and not path.exists():
        _make(path)
    secret, found = _read(path)
    if found.st_uid not in (os.geteuid(), 0):
        raise KeysError(f"{path}: belongs to another account, expected this one's")
    if found.st_mode & _FOR_OTHERS:
        mode = f"{stat.S_IMODE(found.st_mode):o}"
        raise KeysError(f"{path}: other accounts have access (mode {mode}), expected mode 600")
    return secret


def _make(path: Path) -> None:
    """Write it completely under another name, then link it: the first of several processes wins."""
    part = path.with_name(f"{path.name}.{secrets.token_hex(8)}.part")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w", encoding="ascii") as file:
            file.write(secrets.token_hex(LENGTH // 2))
            file.flush()
            os.fsync(file.fileno())
        with contextlib.suppress(FileExistsError):
            os.link(part, path)
    except OSError as error:
        raise KeysError(f"{path}: secret of the rig cannot be made: {reason_of(error)}") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def _read(path: Path) -> tuple[bytes, os.stat_result]:
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(handle, "rb") as file:
            found, secret = os.fstat(handle), file.read(LENGTH + 1)
    except OSError as error:
        raise KeysError(
            f"{path}: secret of the rig cannot be read: {reason_of(error)}; commands are accepted "
            "from the account that runs the rig"
        ) from None
    if len(secret) != LENGTH:
        raise KeysError(f"{path}: found no secret, expected {LENGTH} characters; remove the file")
    return secret, found
