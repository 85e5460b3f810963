"""How a process is told to end: by SIGINT or SIGTERM, after which its loop stops in good order."""

import signal
import threading


def set_at_signal(stop: threading.Event | None = None) -> threading.Event:
    """`stop`, or a new event, which SIGINT and SIGTERM set from now on; for the main thread."""
    event = stop or threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: event.set())
    return event
