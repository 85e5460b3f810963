"""The files of the served folder that a user put there."""

import os
from collections.abc import Iterator
from pathlib import Path

DEEP = 3
"""Levels of folders below the root that are looked into."""


def visible_files(root: Path) -> Iterator[Path]:
    """Files below `root` outside hidden folders; links that lead outside are skipped.

    What is removed meanwhile, as uploads and results are at any moment, is passed over.
    """
    within = root.resolve()
    for folder, folders, names in os.walk(root, followlinks=True):
        at = Path(folder)
        deeper = len(at.relative_to(root).parts) < DEEP
        folders[:] = [name for name in folders if deeper and not name.startswith(".")]
        for name in names:
            if (at / name).resolve().is_relative_to(within):
                yield at / name
