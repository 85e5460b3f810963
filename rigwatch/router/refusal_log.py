"""Counts refused connections and messages in Zenoh's log, which is the only place that shows them.

The process's standard output is led through a pipe. Lines about refusals are counted and removed,
lines about links in order are removed, and everything else is passed on. The pipe is emptied
whatever becomes of the output: Zenoh waits while it is full, and with it all that the router
forwards.
"""

import fcntl
import os
import threading

from rigwatch.wire.bus import (
    DENIED_MARK,
    LINK_MARK,
    REFUSED_MARK,
    SILENT_MARK,
    log_refusals,
)
from rigwatch.wire.host import Printer

PIPE_BYTES = 1 << 20
LONGEST_LINE = 1 << 16
_STDOUT = 1
_DENIED, _REFUSED, _IN_ORDER, _OTHER = range(4)


class RefusalLog:
    """The refusals since the start; opened once per process.

    Attributes:
        connections: connections that did not say who they are in time, or, with keys, without a
            valid certificate of the rig's authority.
        messages: messages, queries and declarations that the access list or the size limit denied.
    """

    def __init__(self) -> None:
        self.connections = self.messages = 0
        self._rest = b""
        self._through = -1
        self._printer: Printer | None = None
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Lead standard output through the counter."""
        self._through = os.dup(_STDOUT)
        self._printer = Printer(self._through, _unprinted)
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
        if self._printer:
            self._printer.close()

    def _run(self, reading: int) -> None:
        while chunk := os.read(reading, PIPE_BYTES):
            self._pass_on(self.take(chunk))
        self._pass_on(self._rest)

    def _pass_on(self, other: bytes) -> None:
        assert self._printer is not None
        for line in other.splitlines(keepends=True):
            self._printer.print(line.decode(errors="replace"))

    def take(self, chunk: bytes) -> bytes:
        """Count the refusals in the next bytes of the log; returns all other complete lines."""
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        kinds = [_kind(line) for line in lines]
        self.messages += kinds.count(_DENIED)
        self.connections += kinds.count(_REFUSED)
        others = (line for line, kind in zip(lines, kinds, strict=True) if kind == _OTHER)
        return b"".join(line + b"\n" for line in others)


def _kind(line: bytes) -> int:
    """What a line of the log is about."""
    if DENIED_MARK in line:
        return _DENIED
    if REFUSED_MARK in line or SILENT_MARK in line:
        return _REFUSED
    return _IN_ORDER if LINK_MARK in line and b"DEBUG" in line else _OTHER


def _unprinted(count: int) -> str:
    """What is printed in place of so many lines."""
    return f"{count} lines of the router's log could not be printed\n"
