"""Position of a recording in the numbered topics, stored beside its segments.

A recorder that was killed and restarted queries the rings from there on. The file is written after
the segment: a kill in between repeats messages of half a second but loses none.
"""

import contextlib
from pathlib import Path

import msgspec

from rigwatch.wire.bus import Place
from rigwatch.wire.typed_files import JsonError, json_value

FILE = "positions.json"
Positions = dict[str, dict[str, Place]]
"""For each numbered topic and process: run and number of the last stored message."""


def save_positions(folder: Path, positions: Positions) -> None:
    """Write the positions; a disk that cannot be written is reported by the segments."""
    new = folder / f"{FILE}.new"
    with contextlib.suppress(OSError):
        new.write_bytes(msgspec.json.encode(positions))
        new.replace(folder / FILE)


def load_positions(folder: Path) -> Positions:
    """The positions stored in `folder`; empty if they cannot be read."""
    try:
        return json_value((folder / FILE).read_bytes(), Positions)
    except (OSError, JsonError):
        return {}
