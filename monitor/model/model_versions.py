"""The model file with its history: all previous versions are kept next to it.

model.toml                the current model, read at the monitor's start
model.v1.toml, .v2.toml   former versions, the newest with the highest number
model.undone-….toml       rolled-back versions, named by the start of their SHA-256
model.history.jsonl       who, whether proved, when, what and why: a line for each change
"""

import contextlib
import glob
import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO, cast

import msgspec

from rigwatch.wire.errors import ConfigError, reason_of
from rigwatch.wire.host import replace_file
from rigwatch.wire.messages import NOT_PROVED, Identity
from rigwatch.wire.typed_files import JsonError, json_value


@dataclass(frozen=True, slots=True)
class Author:
    """Who changes the model, why, and whether the user is proved by a signature."""

    user: str
    why: str
    identity: Identity = NOT_PROVED


class Version(msgspec.Struct, frozen=True):
    """One line of the history.

    Attributes:
        t_ns: of the change [ns].
        step: "commission", "promote" or "rollback".
        user: who made it.
        why: the reason, in words.
        identity: whether the user is proved by a signature; empty in older lines.
        sha256: of the model in force since.
    """

    t_ns: int
    step: str
    user: str
    why: str
    sha256: str
    identity: str = ""


def history(path: Path) -> list[Version]:
    """All changes of the model at `path`, oldest first; an incomplete line is skipped.

    Raises:
        ConfigError: the history cannot be read.
    """
    file = _history(path)
    try:
        lines = file.read_bytes().splitlines() if file.exists() else []
    except OSError as error:
        raise ConfigError(file, "", reason_of(error), "a readable file") from error
    found = []
    for line in lines:
        with contextlib.suppress(JsonError):
            found.append(json_value(line, Version))
    return found


def digest_of(path: Path) -> str:
    """SHA-256 of the model in force, as its history records it; empty if it cannot be read."""
    try:
        return _sha256(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return ""


def install(path: Path, text: str, t_ns: int, author: Author, step: str = "promote") -> None:
    """Install a new version and keep the previous one, if there is one.

    Raises:
        ConfigError: a file cannot be written.
    """
    try:
        # Opened first: nothing changes if its line could not be written.
        with _history(path).open("a+b") as lines:
            if path.exists():
                number = max(_numbers(path), default=0) + 1
                replace_file(_version(path, number), path.read_bytes())
            replace_file(path, text)
            _note(lines, step, text, t_ns, author)
    except OSError as error:
        raise ConfigError(path, "", reason_of(error), "a file to write") from error


def rewrite(path: Path, text: str, t_ns: int) -> None:
    """Write the model in force in another form; its line of the history is repeated with its hash.

    Raises:
        ConfigError: a file cannot be read or written.
    """
    now = digest_of(path)
    line = next((one for one in reversed(history(path)) if one.sha256 == now), None)
    try:
        if line is None:
            replace_file(path, text)
            return
        with _history(path).open("a+b") as lines:
            replace_file(path, text)
            author = Author(line.user, line.why, cast("Identity", line.identity or NOT_PROVED))
            _note(lines, line.step, text, t_ns, author)
    except OSError as error:
        raise ConfigError(path, "", reason_of(error), "a file to write") from error


def newest_before(path: Path) -> Path:
    """The file of the version before; there must be one."""
    return _version(path, max(_numbers(path)))


def version_before(path: Path) -> str:
    """Text of the version that a rollback restores.

    Raises:
        ConfigError: there is none, or it cannot be read.
    """
    if not _numbers(path):
        raise ConfigError(path, "", "no version before this one", "one to roll back to")
    try:
        return newest_before(path).read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(path, "", reason_of(error), "a readable file") from error


def roll_back(path: Path, t_ns: int, author: Author) -> str:
    """Restore the previous version; returns its text.

    Raises:
        ConfigError: there is none, or a file cannot be written.
    """
    text = version_before(path)
    try:
        with _history(path).open("a+b") as lines:
            undone = path.read_text(encoding="utf-8")
            replace_file(path.with_name(f"{path.stem}.undone-{_sha256(undone)[:8]}.toml"), undone)
            replace_file(path, text)
            newest_before(path).unlink()
            _note(lines, "rollback", text, t_ns, author)
    except OSError as error:
        raise ConfigError(path, "", reason_of(error), "a file to write") from error
    return text


def _numbers(path: Path) -> list[int]:
    found = (
        file.name[len(path.stem) + 2 : -5]
        for file in path.parent.glob(f"{glob.escape(path.stem)}.v*.toml")
    )
    return [int(number) for number in found if number.isdigit()]


def _version(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}.v{number}.toml")


def _note(lines: BinaryIO, step: str, text: str, t_ns: int, author: Author) -> None:
    """Append a line to the history, a new one even where a kill has left an incomplete one."""
    line = {"t_ns": t_ns, "step": step, **asdict(author), "sha256": _sha256(text)}
    size = lines.seek(0, os.SEEK_END)
    lines.seek(max(size - 1, 0))
    torn = b"" if lines.read(1) in (b"", b"\n") else b"\n"
    lines.write(torn + json.dumps(line, ensure_ascii=False).encode() + b"\n")


def _history(path: Path) -> Path:
    return path.with_name(f"{path.stem}.history.jsonl")


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
