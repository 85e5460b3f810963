"""The ledger: one line of JSON for every step of a study, with hashes of what it stood on.

A step can be told later, and done again: data files, model and effects are named by their SHA-256.
Data that have changed since are refused, so that errors before and after an effect stay comparable.
"""

import hashlib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.version import __version__
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.study import Study


def data_hashes(study: Study) -> dict[str, str]:
    """SHA-256 of every recording of the study, by the name that its file gives it.

    Raises:
        ModelError: a recording is not there.
    """
    return {name: _hash(path) for name, path in study.sessions().items()}


def _hash(path: Path) -> str:
    files = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
    digest = hashlib.sha256()
    for file in files:
        try:
            digest.update(file.read_bytes())
        except OSError as error:
            raise ModelError(
                f"{file}: {error.strerror}, expected a session of the study"
            ) from error
    return digest.hexdigest()


def model_hash(study: Study) -> str:
    """SHA-256 of the base model and of the accepted effects' declarations."""
    effects = [(a.effect, a.port, study.effect(a.effect)) for a in study.file.effects]
    text = msgspec.json.encode((study.model, effects), order="deterministic")
    return hashlib.sha256(text).hexdigest()


def append(study: Study, step: str, **content: Any) -> dict[str, Any]:
    """Write one line; what was written."""
    line = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "rigwatch": __version__,
        "step": step,
        "data": data_hashes(study),
        "model": model_hash(study),
        "effects": [f"{a.effect}@{a.port}" for a in study.file.effects],
        **content,
    }
    with study.ledger.open("ab") as file:
        file.write(msgspec.json.encode(line) + b"\n")
    return line


def lines(study: Study) -> Iterator[dict[str, Any]]:
    """The steps so far, the oldest first; a line that broke off is left out."""
    if not study.ledger.exists():
        return
    for raw in study.ledger.read_bytes().splitlines():
        try:
            yield msgspec.json.decode(raw)
        except msgspec.DecodeError:
            continue


def check_data(study: Study) -> None:
    """Refuse data that are not those of the last step.

    Raises:
        ModelError: a recording has changed or is gone.
    """
    known: dict[str, str] = {}
    for line in lines(study):
        known |= line.get("data", {})
    for name, digest in data_hashes(study).items():
        if known.get(name, digest) != digest:
            raise ModelError(
                f"{study.folder}: {name} has changed since the last step: errors before and after"
                " would not be comparable; `rigwatch study accept-data` takes it as it is now"
            )
