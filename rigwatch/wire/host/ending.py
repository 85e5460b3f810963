"""Ends a process on SIGINT or SIGTERM: its loop then stops in order."""

import signal
import threading


def set_at_signal(stop: threading.Event | None = None) -> threading.Event:
    """Let SIGINT and SIGTERM set `stop`, or a new event, and return it; for the main thread."""
    event = stop or threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: event.set())
    return event
