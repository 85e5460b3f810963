"""What a study's process found, on disk, so that pages show it without fitting again.

One folder a model: it is found by the hash of all that its errors depend on, so that a study that
is changed anywhere finds none until it is fitted. Each result is written whole or not at all.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigwatch.workbench.study import Study, stands_on

FOLDER = ".workbench"
KEPT = 24
"""Models whose results are kept, the latest used."""


def as_plain(value: Any) -> Any:
    """Dataclasses and structs as JSON has them; what is not finite becomes None."""
    return msgspec.json.decode(msgspec.json.encode(value, enc_hook=_plain))


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise NotImplementedError(type(value).__name__)


def signal_key(use: str, line: str, channel: str) -> str:
    """Name of a line: of "train" or "held_out", such as "residual", of a channel."""
    return f"{use}.{line}.{channel}"


def results_of(study: Study) -> "Results":
    """Where the results of a study's model as it is are.

    Raises:
        ModelError: a recording is not there.
    """
    return Results(study.folder / FOLDER / stands_on(study)[:32])


@dataclass(frozen=True)
class Results:
    """The results of one model of a study.

    Attributes:
        folder: where they are; need not exist.
    """

    folder: Path

    def has(self, name: str) -> bool:
        """Whether a result is there."""
        return (self.folder / name).exists()

    def read(self, name: str) -> Any:
        """A result that was written as JSON, None where it is not there."""
        try:
            return msgspec.json.decode((self.folder / f"{name}.json").read_bytes())
        except FileNotFoundError:
            return None

    def write(self, name: str, value: Any) -> None:
        """Write a result as JSON."""
        self.folder.mkdir(parents=True, exist_ok=True)
        beside = self.folder / f"{name}.{os.getpid()}.part"
        beside.write_bytes(msgspec.json.encode(as_plain(value)))
        beside.replace(self.folder / f"{name}.json")

    @contextmanager
    def whole(self, name: str) -> Iterator[Path]:
        """A folder to fill, which becomes the result `name` once it is full."""
        beside = self.folder / f"{name}.{os.getpid()}.part"
        shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir(parents=True)
        try:
            yield beside
            shutil.rmtree(self.folder / name, ignore_errors=True)
            beside.replace(self.folder / name)
        finally:
            shutil.rmtree(beside, ignore_errors=True)

    def forget_old(self) -> None:
        """Drop the results of models that were not looked at for longest."""
        os.utime(self.folder)
        every = sorted(self.folder.parent.iterdir(), key=lambda path: -path.stat().st_mtime)
        for path in every[KEPT:]:
            shutil.rmtree(path, ignore_errors=True)
