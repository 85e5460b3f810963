"""Waiting for other processes and threads: tests wait for a condition, never for a time."""

import time
from collections.abc import Callable
from pathlib import Path

PATIENCE = 180.0
"""Longest that anything may take before a test fails; machines are slow at times [s]."""
PAUSE, SHARE, LONGEST = 0.02, 0.1, 0.2
"""Pause between two looks [s]; after a second, as a share of the time since then; at most [s]."""


def wait_until(holds: Callable[[], bool], timeout: float, pause: float = PAUSE) -> bool:
    """Poll until `holds()` or until `timeout` [s] has passed; returns what it said last."""
    return _waited(holds, timeout, lambda _: pause)


def eventually(holds: Callable[[], bool], what: str) -> None:
    """Wait for a condition, and fail with its name where it does not come.

    What takes long is looked at more seldom: looking takes the processor from what is waited for.
    """

    def pause(waited: float) -> float:
        return min(max(PAUSE, SHARE * (waited - 1.0)), LONGEST)

    done = _waited(holds, PATIENCE, pause)
    assert done, f"not within {PATIENCE:g} s: {what}"


def _waited(holds: Callable[[], bool], timeout: float, pause: Callable[[float], float]) -> bool:
    """Poll, with pauses [s] by the time that has passed [s]."""
    began = time.monotonic()
    while not (done := holds()) and (waited := time.monotonic() - began) < timeout:
        time.sleep(pause(waited))
    return done


def runs(pid: int) -> bool:
    """Whether a process runs; where nobody reaps orphans, an ended one stays as a zombie."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"
