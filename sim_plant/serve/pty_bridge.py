"""Two pseudo terminals back to back: a cable between two programs that each need a port."""

import contextlib
import os
import pty
import threading
import tty
from pathlib import Path

from rigwatch.wire.host import ready_to_read
from sim_plant.serve.pty_line import PtyLine


class PtyBridge:
    """A cable with the device's end at `device_end` and the reader's at `link`.

    Args:
        link: path of the symbolic link to the reader's end.
    """

    def __init__(self, link: Path | str) -> None:
        self.line = PtyLine(link)
        self.device_end = ""
        self._master = -1
        self._slave = -1
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "PtyBridge":
        self.line.plug()
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device_end = os.ttyname(self._slave)
        self._stop.clear()
        self._thread = threading.Thread(target=self._carry, name="pty-bridge", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self.line.unplug()
        os.close(self._master)
        os.close(self._slave)

    def _carry(self) -> None:
        while not self._stop.is_set():
            if not self.line.heard():
                # A line that no process has open is always readable: retry later.
                self._to_reader(0.02)
                continue
            ready = ready_to_read((self._master, self.line.fileno()), 0.1)
            if self._master in ready:
                self._to_reader(0.0)
            if self.line.fileno() in ready:
                with contextlib.suppress(OSError):
                    os.write(self._master, self.line.read())

    def _to_reader(self, timeout: float) -> None:
        if ready_to_read((self._master,), timeout):
            with contextlib.suppress(OSError):
                self.line.write(os.read(self._master, 4096))
