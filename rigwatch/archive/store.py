"""Files of an archive: a local folder, or any address that fsspec knows (s3://, gs://, …).

A request that fails is made again a few times, later each time: object stores fail now and then.
"""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from rigwatch.wire.errors import ArchiveError, MissingExtraError, one_line, reason_of
from rigwatch.wire.new_file import new_file

T = TypeVar("T")
ATTEMPTS = 5
FIRST_PAUSE_S = 0.2
_FINAL = (FileNotFoundError, PermissionError, IsADirectoryError, NotADirectoryError)


@dataclass(frozen=True, slots=True)
class Stored:
    """One file: its name below the archive, its size [bytes], and a stamp that changes with it."""

    name: str
    size: int
    stamp: str

    def __str__(self) -> str:
        return f"{self.name} {self.size} {self.stamp}"


class Store:
    """The files below an address.

    Args:
        url: a folder, or an address such as "s3://bucket/rigs".
        options: of the file system, such as an end point; None for its own.

    Raises:
        ArchiveError: the address is of an unknown kind, or its package is not installed.
        MissingExtraError: fsspec is not installed.
    """

    def __init__(self, url: str, options: dict[str, Any] | None = None) -> None:
        fsspec = _fsspec()
        self.url, self.options = url.rstrip("/"), options or {}
        try:
            self.files, self.root = fsspec.core.url_to_fs(self.url, **self.options)
        except ImportError as error:
            package = _package(error)
            text = f"this kind of address needs the package {package}: pip install {package}"
            raise ArchiveError(f"{url}: {text}") from None
        except (ValueError, OSError) as error:
            raise ArchiveError(f"{url}: {error}, expected a folder or an address") from None
        self.root = self.root.rstrip("/")
        self.is_local = bool(getattr(self.files, "local_file", False))

    def path(self, name: str) -> str:
        """The whole path of a file, as the file system takes it."""
        return f"{self.root}/{name}"

    def address(self, name: str) -> str:
        """The whole address of a file, with its kind."""
        return (
            self.path(name) if self.is_local else str(self.files.unstrip_protocol(self.path(name)))
        )

    def listed(self, below: str = "") -> list[Stored]:
        """All files below a folder, in order of their names; none if it does not exist.

        Raises:
            ArchiveError: the archive cannot be reached.
        """
        place = self.path(below) if below else self.root
        # What another process wrote must be seen.
        self.files.invalidate_cache()
        try:
            found = self._again(lambda: self.files.find(place, detail=True), place)
        except FileNotFoundError:
            return []
        files = (_stored(path[len(self.root) + 1 :], about) for path, about in found.items())
        return sorted(files, key=lambda file: file.name)

    def glob(self, pattern: str) -> list[str]:
        """Names of files and folders that a pattern matches.

        Raises:
            ArchiveError: the archive cannot be reached.
        """
        self.files.invalidate_cache()
        found = self._again(lambda: self.files.glob(self.path(pattern)), pattern)
        return [path[len(self.root) + 1 :] for path in found]

    def check(self) -> None:
        """Raise ArchiveError if there is no such archive."""
        try:
            there = self._again(lambda: self.files.exists(self.root), self.root)
        except OSError as error:
            raise ArchiveError(f"{self.url}: {reason_of(error)}") from None
        if not there:
            raise ArchiveError(f"{self.url}: no such folder, expected an archive of sessions")

    @contextmanager
    def local(self, names: list[str]) -> Iterator[list[Path]]:
        """Files as local ones: themselves, or copies for as long as they are needed."""
        if self.is_local:
            yield [Path(self.path(name)) for name in names]
            return
        with TemporaryDirectory(prefix="rigwatch-") as folder:
            copies = [Path(folder, Path(name).name) for name in names]
            for name, copy in zip(names, copies, strict=True):
                self._fetch(name, copy)
            yield copies

    def _fetch(self, name: str, target: Path) -> None:
        self._again(lambda: self.files.get_file(self.path(name), str(target)), name)

    def put(self, source: Path, name: str) -> None:
        """Store a local file under a name, whole or not at all."""
        path = self.path(name)
        if not self.is_local:
            self._again(lambda: self.files.put_file(str(source), path), name)
            return
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        with new_file(target, replace=True, raises=ArchiveError) as part:
            shutil.copyfile(source, part)

    def remove(self, name: str) -> None:
        """Remove a file, if it is there, and its folder if that is empty then."""
        with suppress(FileNotFoundError):
            self._again(lambda: self.files.rm_file(self.path(name)), name)
        if self.is_local and "/" in name:
            with suppress(OSError):
                Path(self.path(name)).parent.rmdir()

    def _again(self, call: Callable[[], T], what: str) -> T:
        """The call, made again if it fails for a reason that may pass."""
        for attempt in range(ATTEMPTS):
            try:
                return call()
            except _FINAL:
                raise
            except OSError as error:
                if attempt == ATTEMPTS - 1 or self.is_local:
                    raise ArchiveError(f"{self.url}: {what}: {reason_of(error)}") from None
                time.sleep(FIRST_PAUSE_S * 2**attempt)
            except Exception as error:  # every file system has errors of its own
                reason = one_line(error)
                raise ArchiveError(f"{self.url}: {type(error).__name__}: {reason}") from None
        raise AssertionError("the last attempt returns or raises")


def _stored(name: str, about: dict[str, Any]) -> Stored:
    stamp = about.get("ETag") or about.get("etag") or about.get("md5Hash") or about.get("mtime")
    return Stored(name, int(about.get("size") or 0), str(stamp or about.get("LastModified", "")))


def _fsspec() -> Any:
    try:
        import fsspec
    except ImportError:
        raise MissingExtraError("fsspec", "archive", "an archive") from None
    return fsspec


def _package(error: ImportError) -> str:
    """The package that fsspec asks for in its message, such as "Install s3fs to access S3"."""
    words = str(error).split()
    return words[words.index("Install") + 1] if "Install" in words[:-1] else error.name or "fsspec"
