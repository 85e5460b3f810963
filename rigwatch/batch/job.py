"""A job: a function of one recording or study, and what identifies its results.

A result is identified by the path and the content of its recording, the job, the job's settings
and the version of rigwatch. Settings that are files count with their content.
"""

import hashlib
import inspect
import stat
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.version import __version__
from rigwatch.wire.errors import BatchError, RigwatchError, reason_of
from rigwatch.wire.typed_files import as_json

WORKER_DIED = "WorkerDied"
"""Kind of failure of a unit whose worker ended each time."""
AT_ONCE = 1 << 20
"""Largest file that is read in one piece [bytes]: the buffer for a larger one takes longer to make
than the recording of some seconds to read."""


def content_hash(path: Path) -> str:
    """SHA-256 of a file, or of the names and contents of all files of a folder.

    Raises:
        OSError: a file cannot be read, or is none: to open a pipe would wait for ever.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        files = sorted(file for file in path.rglob("*") if file.is_file())
        listed = [(str(file.relative_to(path)), content_hash(file)) for file in files]
        return hashlib.sha256(msgspec.json.encode(listed)).hexdigest()
    if not stat.S_ISREG(status.st_mode):
        raise OSError(f"{path}: is no file")
    with path.open("rb", buffering=0) as file:
        if status.st_size <= AT_ONCE:
            return hashlib.sha256(file.read()).hexdigest()
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True, slots=True)
class Job:
    """What is done with each unit.

    Attributes:
        name: names the job in results.
        call: called with the path of a unit and the settings; returns plain data. A function of
            a module, so that it can be sent to a worker.
        content: hash of everything that the unit's result depends on.
        unit: what a unit's text stands for, as `call` and `content` take it.
    """

    name: str
    call: Callable[..., Any]
    content: Callable[[Any], str] = content_hash
    unit: Callable[[str], Any] = Path

    def identity(self, settings: Mapping[str, Any]) -> str:
        """SHA-256 of the job, its settings and the version of rigwatch.

        Raises:
            BatchError: a setting has no plain form, or names a missing file.
        """
        settled = {name: _settled(name, value) for name, value in settings.items()}
        whole = (self.name, _code(self.call), settled, __version__)
        return hashlib.sha256(msgspec.json.encode(whole, order="deterministic")).hexdigest()


def job_of(job: "Job | Callable[..., Any]") -> Job:
    """A plain function as a job, named by its module and its name."""
    if isinstance(job, Job):
        return job
    function = job.func if isinstance(job, partial) else job
    name = getattr(function, "__qualname__", type(function).__qualname__)
    return Job(f"{function.__module__}.{name}", job)


def _code(call: Callable[..., Any]) -> str:
    """The source of a user's function, so that an edited one does not keep old results."""
    if isinstance(call, partial):
        return f"{_code(call.func)}{call.args}{sorted(call.keywords.items())}"
    if call.__module__.partition(".")[0] == "rigwatch":
        return ""  # rigwatch's own: the version identifies it
    try:
        return inspect.getsource(call)
    except (OSError, TypeError):
        return ""


def _settled(name: str, value: Any) -> Any:
    """A setting as plain data; a file is its content."""
    try:
        if isinstance(value, Path):
            return ["file", content_hash(value)]
        msgspec.json.encode(value)
    except OSError as error:
        raise BatchError(f"{value}: {reason_of(error)}, expected a file for {name}") from None
    except (TypeError, NotImplementedError):
        kind = type(value).__name__
        raise BatchError(f"setting {name}: found {kind}, expected plain data or a path") from None
    return value


class Outcome(msgspec.Struct, frozen=True):
    """The result of one unit, or why there is none.

    Attributes:
        path: the recording or study.
        content: hash of its content; "" if it was not read.
        value: the result as JSON; b"" for a failure.
        kind: class of the error; "" for a result.
        error: the error in one line.
        seconds: time that the job took [s]; not part of the result.
    """

    path: str
    content: str
    value: bytes = b""
    kind: str = ""
    error: str = ""
    seconds: float = 0.0

    @property
    def failed(self) -> bool:
        """Whether there is no result."""
        return bool(self.kind)


_PACKED = msgspec.msgpack.Decoder(list[Outcome])


def pack(outcomes: Sequence[Outcome]) -> bytes:
    """Outcomes as a worker sends them: in one piece.

    Dask sends a list element by element, which takes worker and client some 40 µs of processor
    time for each outcome; so it is 1 µs.
    """
    return msgspec.msgpack.encode(outcomes)


def unpack(sent: bytes) -> list[Outcome]:
    """The outcomes that a worker sent, in their order."""
    return _PACKED.decode(sent)


def run_units(
    job: Job, settings: Mapping[str, Any], paths: Sequence[str], version: str
) -> list[Outcome]:
    """Run the job on some units: what a worker does.

    Raises:
        BatchError: the worker has another version of rigwatch than the client.
    """
    if version != __version__:
        found = f"a worker has rigwatch {__version__}, the client {version}"
        raise BatchError(f"{found}: install the same version on both")
    return [_run_unit(job, settings, path) for path in paths]


def _run_unit(job: Job, settings: Mapping[str, Any], path: str) -> Outcome:
    content, began = "", time.perf_counter()
    try:
        unit = job.unit(path)
        content = job.content(unit)
        value = job.call(unit, **settings)
        return Outcome(
            path, content, as_json(value, sort_keys=True), seconds=time.perf_counter() - began
        )
    except RigwatchError as error:
        kind, text = type(error).__name__, str(error)
    except OSError as error:
        kind, text = type(error).__name__, f"{error.filename or path}: {reason_of(error)}"
    except Exception as error:  # one unit's failure is not that of the others
        kind, text = type(error).__name__, f"{path}: {error}"
    line = " ".join(text.split())
    return Outcome(path, content, b"", kind, line, time.perf_counter() - began)
