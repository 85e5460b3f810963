"""Waiting for other processes and threads: tests wait for a condition, never for a time."""

from collections.abc import Callable

from rigwatch.wire.bus.bus import wait_until

PATIENCE = 180.0
"""Longest that anything may take before a test fails; machines are slow at times [s]."""


def eventually(holds: Callable[[], bool], what: str) -> None:
    """Wait for a condition, and fail with its name where it does not come."""
    assert wait_until(holds, PATIENCE), f"not within {PATIENCE:g} s: {what}"
