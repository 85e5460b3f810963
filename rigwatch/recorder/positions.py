"""How far a recording has come in what processes said, kept beside its segments.

A recorder that was killed and started again asks their rings from there on. The file is written
after the segment: a kill in between repeats messages of half a second, and loses none.
"""

import contextlib
from pathlib import Path

import msgspec

from rigwatch.wire.bus import Place

FILE = "positions.json"
Positions = dict[str, dict[str, Place]]
"""Of each numbered topic and process: run and number of the last message kept."""


def save_positions(folder: Path, positions: Positions) -> None:
    """Write them; a disk that cannot take them is told of by the segments."""
    new = folder / f"{FILE}.new"
    with contextlib.suppress(OSError):
        new.write_bytes(msgspec.json.encode(positions))
        new.replace(folder / FILE)


def load_positions(folder: Path) -> Positions:
    """What stands in `folder`; nothing where nothing can be read."""
    try:
        return msgspec.json.decode((folder / FILE).read_bytes(), type=Positions)
    except (OSError, msgspec.DecodeError, ValueError):
        return {}
