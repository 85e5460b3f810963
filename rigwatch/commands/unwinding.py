"""Signals that end a command: what it has begun to write is removed first."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_ENDING = (signal.SIGTERM, signal.SIGHUP)


class _EndedError(BaseException):
    """A signal ends the command."""


@contextmanager
def unwound_at_signal() -> Iterator[None]:
    """Let SIGTERM and SIGHUP leave the block by an exception, then end the process as they do.

    A signal that the process ignores or handles itself is left alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    own = os.getpid()

    def end(number: int, _: object) -> None:
        if os.getpid() == own:
            raise _EndedError(number)
        _end_by(number)  # a forked worker has nothing to unwind

    taken = [number for number in _ENDING if signal.getsignal(number) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, end)
    try:
        yield
    except _EndedError as ended:
        _end_by(ended.args[0])
    finally:
        for number in taken:
            if signal.getsignal(number) is end:
                signal.signal(number, signal.SIG_DFL)


def _end_by(number: int) -> None:
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
