"""Counts refused connections and messages in Zenoh's log, which is the only place that shows them.

The process's standard output is led through a pipe. Lines about refusals are counted and removed;
everything else is passed on.
"""

import fcntl
import os
import threading

from rigwatch.wire.bus import DENIED_MARK, REFUSED_MARK, log_refusals

PIPE_BYTES = 1 << 20
LONGEST_LINE = 1 << 16
_STDOUT = 1


class RefusalLog:
    """The refusals since the start; opened once per process.

    Attributes:
        connections: connections without a valid certificate of the rig's authority.
        messages: messages, queries and declarations that the access list or the size limit denied.
    """

    def __init__(self) -> None:
        self.connections = self.messages = 0
        self._rest = b""
        self._through = -1
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Lead standard output through the counter."""
        self._through = os.dup(_STDOUT)
        reading, writing = os.pipe()
        fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        os.dup2(writing, _STDOUT)
        os.close(writing)
        self._thread = threading.Thread(target=self._run, args=(reading,), daemon=True)
        self._thread.start()
        log_refusals()

    def close(self) -> None:
        """Lead standard output past the counter again, after all that was written to it."""
        if self._thread:
            os.dup2(self._through, _STDOUT)
            self._thread.join()

    def _run(self, reading: int) -> None:
        while chunk := os.read(reading, PIPE_BYTES):
            if other := self.take(chunk):
                os.write(self._through, other)
        os.write(self._through, self._rest)

    def take(self, chunk: bytes) -> bytes:
        """Count the refusals in the next bytes of the log; returns all other complete lines."""
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        denied = sum(DENIED_MARK in line for line in lines)
        refused = sum(REFUSED_MARK in line for line in lines)
        self.messages += denied
        self.connections += refused
        if denied + refused == len(lines):
            return b""
        others = (line for line in lines if DENIED_MARK not in line and REFUSED_MARK not in line)
        return b"".join(line + b"\n" for line in others)
