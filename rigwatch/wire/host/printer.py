"""Prints lines without ever waiting: the output may be closed, full, or read by nobody.

print → waiting lines (bounded, newest dropped and counted) → thread → file descriptor
"""

import contextlib
import os
import threading
from collections import deque
from collections.abc import Callable

MOST_WAITING = 1000
"""Lines that wait for a stalled output; later ones are dropped."""
LAST_WORDS = 1.0
"""Longest wait for the output at the end [s]."""


class Printer:
    """Prints to a file descriptor from a thread of its own.

    Args:
        output: file descriptor.
        told: the text that says how many texts could not be printed.
    """

    def __init__(self, output: int, told: Callable[[int], str]) -> None:
        self._output, self._told = output, told
        self._waiting: deque[bytes] = deque()
        self._lost = 0
        self._torn = self._ends = False
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="printer", daemon=True)
        self._thread.start()

    def print(self, text: str) -> None:
        """Queue a text."""
        with self._change:
            if len(self._waiting) < MOST_WAITING:
                self._waiting.append(text.encode(errors="replace"))
            else:
                self._lost += 1
            self._change.notify()

    def close(self) -> None:
        """Print what waits, if the output takes it within a second."""
        with self._change:
            self._ends = True
            self._change.notify()
        self._thread.join(LAST_WORDS)

    def _run(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._waiting or self._ends)
                if not self._waiting:
                    return
                data, lost = self._waiting.popleft(), self._lost
                self._lost = 0
            if lost:
                data = self._told(lost).encode() + data
            if not self._written(data):
                with self._change:
                    self._lost += lost + 1

    def _written(self, data: bytes) -> bool:
        """Whether the whole text was taken; a closed or full output takes nothing."""
        rest = b"\n" + data if self._torn else data
        with contextlib.suppress(OSError):
            while rest:
                count = os.write(self._output, rest)
                self._torn = count < len(rest)
                rest = rest[count:]
        return not rest
