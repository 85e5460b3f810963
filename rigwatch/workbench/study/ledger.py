"""The ledger: one line of JSON per step of a study, with hashes of its inputs.

Data files, model and effects are identified by their SHA-256, so a step can be audited and
repeated. Changed data are refused, so that errors before and after an effect stay comparable.
"""

import hashlib
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.version import __version__
from rigwatch.wire.errors import ModelError, reason_of
from rigwatch.wire.typed_files import JsonError, json_value, read_text
from rigwatch.workbench.study.folder import FILE, digest, locked, write_step
from rigwatch.workbench.study.own_files import check_unchanged
from rigwatch.workbench.study.study import Study

_PART = 1 << 22


def data_hashes(study: Study) -> dict[str, str]:
    """SHA-256 of every recording of the study, by its name in the study's file.

    Raises:
        ModelError: a recording is missing.
    """
    return {name: _hash(path) for name, path in study.sessions().items()}


def _hash(path: Path) -> str:
    files = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
    try:
        return _of_files(tuple((file, _state(file.stat())) for file in files))
    except OSError as error:
        raise ModelError(
            f"{error.filename}: {reason_of(error)}, expected a session of the study"
        ) from error


def _state(found: os.stat_result) -> tuple[int, ...]:
    """Fingerprint of a file that changes when the file is written."""
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@lru_cache(maxsize=64)
def _of_files(files: tuple[tuple[Path, tuple[int, ...]], ...]) -> str:
    """SHA-256 of files, cached until a file changes."""
    found = hashlib.sha256()
    for path, _ in files:
        with path.open("rb") as file:
            while part := file.read(_PART):
                found.update(part)
    return found.hexdigest()


def model_hash(study: Study) -> str:
    """SHA-256 of the base model and of the accepted effects' declarations."""
    effects = [(a.effect, a.port, study.effect(a.effect)) for a in study.file.effects]
    text = msgspec.json.encode((study.model, effects), order="deterministic")
    return hashlib.sha256(text).hexdigest()


def stands_on(study: Study) -> str:
    """SHA-256 of everything the study's errors depend on: file, model, effects and data.

    Raises:
        ModelError: a recording is missing.
    """
    whole = (study.file, study.model, dict(study.effects), data_hashes(study), __version__)
    return hashlib.sha256(msgspec.json.encode(whole, order="deterministic")).hexdigest()


def append(study: Study, step: str, /, **content: Any) -> dict[str, Any]:
    """Append one line about the study's current state; return the line.

    Raises:
        ModelError: the study has been changed since it was opened.
    """
    return commit(study, study, step, **content)


def commit(before: Study, after: Study, step: str, /, **content: Any) -> dict[str, Any]:
    """Write the study's file, its own effect and model files and the ledger's line, or nothing.

    Args:
        before: the study as opened.
        after: the study to be written.
        step: name of the step.
        content: further fields of the line.

    Returns:
        The line.

    Raises:
        ModelError: the study has been changed since it was opened.
    """
    line = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "rigwatch": __version__,
        "step": step,
        "data": data_hashes(after),
        "model": model_hash(after),
        "study": digest(after.text),
        "effects": [f"{a.effect}@{a.port}" for a in after.file.effects],
        **content,
    }
    files = {name: new.text for name, new in after.unsaved.items()}
    if files:
        line["files"] = {name: digest(text) for name, text in files.items()}
    text = after.text if files or after.text != before.text else None
    with locked(before.folder) as ledger:
        if read_text(before.folder / FILE) != before.text:
            raise ModelError(
                f"{before.folder}: the study has been changed since this step was tried;"
                " nothing was written"
            )
        check_unchanged(before.folder, before.own_files, after.unsaved)
        write_step(before.folder, ledger, msgspec.json.encode(line) + b"\n", text, files)
    return line


def lines(study: Study) -> Iterator[dict[str, Any]]:
    """The steps so far, oldest first; a line that is no step is skipped."""
    if not study.ledger.exists():
        return
    for raw in study.ledger.read_bytes().splitlines():
        try:
            yield json_value(raw, dict[str, Any])
        except JsonError:
            continue


def check_data(study: Study) -> None:
    """Check that the data are those of the last step.

    Raises:
        ModelError: a recording has changed or is missing.
    """
    known: dict[str, str] = {}
    for line in lines(study):
        known |= line.get("data", {})
    for name, found in data_hashes(study).items():
        if known.get(name, found) != found:
            raise ModelError(
                f"{study.folder}: {name} has changed since the last step: errors before and after"
                " would not be comparable; `rigwatch study accept-data` takes it as it is now"
            )
