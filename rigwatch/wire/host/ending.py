"""Signals as events: SIGINT and SIGTERM end a process in order, SIGHUP renews its configuration."""

import signal
import threading


def set_at_signal() -> threading.Event:
    """A new event that SIGINT and SIGTERM set; for the main thread."""
    event = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: event.set())
    return event


def set_at_hangup() -> threading.Event:
    """A new event that SIGHUP sets; for the main thread."""
    event = threading.Event()
    signal.signal(signal.SIGHUP, lambda *_: event.set())
    return event
