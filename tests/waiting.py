"""Waiting for other processes and threads: tests wait for a condition, never for a time."""

import time
from collections.abc import Callable
from pathlib import Path

PATIENCE = 180.0
"""Longest that anything may take before a test fails; machines are slow at times [s]."""


def wait_until(holds: Callable[[], bool], timeout: float, pause: float = 0.02) -> bool:
    """Poll until `holds()` or until `timeout` [s] has passed; returns what it said last."""
    deadline = time.monotonic() + timeout
    while not (done := holds()) and time.monotonic() < deadline:
        time.sleep(pause)
    return done


def eventually(holds: Callable[[], bool], what: str) -> None:
    """Wait for a condition, and fail with its name where it does not come."""
    assert wait_until(holds, PATIENCE), f"not within {PATIENCE:g} s: {what}"


def runs(pid: int) -> bool:
    """Whether a process runs; where nobody reaps orphans, an ended one stays as a zombie."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"
