"""The recordings of a folder, and their channels for a chart."""

import hashlib
import threading
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.browser.recordings.visible_files import visible_files
from rigwatch.browser.signals import write_trace
from rigwatch.browser.work import RESULTS, Results, apart
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.ordering import elapsed_ns
from rigwatch.wire.session import SUFFIX, open_session

MOST = 500
Shown = tuple[Results, dict[str, Any]]
_WRITING = threading.Lock()


def recordings_in(root: Path) -> list[str]:
    """All sessions below a folder, by relative name; links that lead outside are skipped."""
    found = (path for path in visible_files(root) if path.suffix == SUFFIX and path.is_file())
    return sorted(path.relative_to(root).as_posix() for path in found)[:MOST]


def channels_of(root: Path, path: Path) -> Shown:
    """Folder of a recording's chart data, and its channels; written if missing.

    Raises:
        RigwatchError: the session cannot be read.
    """
    kept = _kept(root, path)
    with _WRITING:  # two that wrote the same would take each other's files away
        if not kept.has("recording.json"):
            kept.write("recording", apart(write_channels, kept, path))
    return kept, kept.read("recording")


def known_channels(root: Path, path: Path) -> Shown | None:
    """The same, if the recording has been read already; otherwise None."""
    kept = _kept(root, path)
    found = kept.read("recording")
    return None if found is None else (kept, found)


def _kept(root: Path, path: Path) -> Results:
    """The folder for the chart data of a recording as it is now."""
    stat = path.stat()
    key = f"{path}:{stat.st_ino}:{stat.st_size}:{stat.st_mtime_ns}"
    return Results(root / RESULTS / hashlib.sha256(key.encode()).hexdigest()[:32])


def check_session(path: Path) -> None:
    """Check the content of a session.

    Raises:
        RigwatchError: it cannot be read.
    """
    open_session(path).check_content()


def write_channels(kept: Results, path: Path) -> dict[str, Any]:
    """Write every channel as a chart line; returns names with units, duration [s] and samples."""
    blocks = list(open_session(path).samples())
    if not blocks:
        raise RigwatchError(f"{path.name}: found no samples")
    times = elapsed_ns(blocks) / 1e9
    columns = [column for column in blocks[0].channels if column.values.dtype.kind == "f"]
    with kept.whole("signals") as folder:
        for column in columns:
            values = [block.channel(column.name).values for block in blocks]
            write_trace(folder, column.name, np.concatenate(values), times)
    channels = {column.name: column.unit for column in columns}
    return {"channels": channels, "seconds": float(times[-1]), "samples": len(times)}
