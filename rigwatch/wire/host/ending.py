"""Signals as events: SIGINT and SIGTERM end a process in order, SIGHUP renews its configuration.

    signal ─▶ handler, within whatever the main thread does ─▶ new thread ─▶ event

A handler must not set an event itself: it interrupts the main thread, which may hold the event's
own lock because it is waiting for the event, and would then wait for itself for ever.
"""

import _thread
import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, TypeVar

PATIENCE = 8.0
"""Longest orderly end of a process whose supervisor is gone; as long as a supervisor waits [s]."""

TURN = 0.05
"""Time between two looks whether a process is to end [s]."""
T = TypeVar("T")


def set_at_signal() -> threading.Event:
    """A new event that SIGINT and SIGTERM set; for the main thread.

    If its supervisor no longer lives, nobody would kill a process that hangs: it kills itself then.
    """
    event, parent = threading.Event(), os.getppid()

    def end() -> None:
        event.set()
        if os.environ.get("NOTIFY_SOCKET"):
            _end_if_orphaned(parent)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _in_a_thread(end))
    return event


def set_at_hangup() -> threading.Event:
    """A new event that SIGHUP sets; for the main thread."""
    event = threading.Event()
    signal.signal(signal.SIGHUP, _in_a_thread(event.set))
    return event


def unless_ended(stop: threading.Event, work: Callable[[], T]) -> T:
    """What `work` returns or raises; once `stop` is set, the process ends with code 0 instead.

    For what takes long, cannot be interrupted and leaves nothing open, as compiling at the start.
    """
    done: Future[T] = Future()

    def run() -> None:
        try:
            done.set_result(work())
        except BaseException as error:
            done.set_exception(error)

    threading.Thread(target=run, name="start", daemon=True).start()
    while not wait([done], TURN).done:
        if stop.is_set():
            _leave()
    return done.result()


def _leave() -> None:
    """End the process without its threads: one that compiles would crash as Python ends."""
    for output in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            output.flush()
    os._exit(0)


def _in_a_thread(act: Callable[[], None]) -> Callable[..., Any]:
    """A handler that acts in a new thread: `threading.Thread` takes locks, this takes none."""

    def handle(*_: object) -> None:
        with contextlib.suppress(RuntimeError):  # the interpreter is already ending
            _thread.start_new_thread(act, ())

    return handle


def _end_if_orphaned(parent: int) -> None:
    time.sleep(PATIENCE)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
