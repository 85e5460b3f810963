"""Results of a study's process on disk, so that pages show them without fitting again.

There is one folder per model, named by the hash of everything its errors depend on. A changed study
therefore has no results until it is fitted. Each result is written atomically.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.host import replace_file
from rigwatch.wire.typed_files import as_json
from rigwatch.workbench.study import Study, stands_on

FOLDER = ".workbench"
KEPT = 24
"""Number of most recently used models whose results are kept."""


def signal_key(use: str, line: str, channel: str) -> str:
    """Name of a line: of "train" or "held_out", such as "residual", of a channel."""
    return f"{use}.{line}.{channel}"


def results_of(study: Study) -> "Results":
    """The results of a study's current model.

    Raises:
        ModelError: a recording is missing.
    """
    return Results(study.folder / FOLDER / stands_on(study)[:32])


@dataclass(frozen=True)
class Results:
    """The results of one model of a study.

    Attributes:
        folder: their folder; need not exist.
    """

    folder: Path

    def has(self, name: str) -> bool:
        """Whether a result exists."""
        return (self.folder / name).exists()

    def read(self, name: str) -> Any:
        """A result written as JSON, None if missing."""
        try:
            return msgspec.json.decode((self.folder / f"{name}.json").read_bytes())
        except FileNotFoundError:
            return None

    def write(self, name: str, value: Any) -> None:
        """Write a result as JSON."""
        self.folder.mkdir(parents=True, exist_ok=True)
        replace_file(self.folder / f"{name}.json", as_json(value), durable=False)

    @contextmanager
    def whole(self, name: str) -> Iterator[Path]:
        """A temporary folder, which becomes the result `name` when complete."""
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
        """Remove the results of the least recently used models."""
        os.utime(self.folder)
        every = sorted(self.folder.parent.iterdir(), key=lambda path: -path.stat().st_mtime)
        for path in every[KEPT:]:
            shutil.rmtree(path, ignore_errors=True)
