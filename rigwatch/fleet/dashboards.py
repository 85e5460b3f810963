"""Opens the dashboard of one rig among many: a process and a page of its own for each."""

import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from typing import IO

from rigwatch.fleet.rig_state import RigState
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import end_process, free_port, is_free, last_line

MOST = 8
"""Dashboards that are open at once; the one that was asked for longest ago makes room."""
PATIENCE = 60.0
"""Longest wait for a page [s]: the viewer is started, and the rig's router answers."""
HOST = "127.0.0.1"
_LOOK_AGAIN = 0.1


@dataclass(frozen=True, slots=True)
class _Dashboard:
    """One that was started: its process, what it says, and the port of its page."""

    process: "subprocess.Popen[bytes]"
    said: IO[bytes]
    port: int

    def end(self) -> None:
        """End it."""
        end_process(self.process, 5.0)
        self.said.close()


class Dashboards:
    """The dashboards that were opened, by rig; each runs until `close`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: dict[str, _Dashboard] = {}

    def address(self, state: RigState) -> str:
        """Where a rig's dashboard is; it is started unless it runs, and waited for.

        Args:
            state: of the rig.

        Raises:
            RigwatchError: it ends at once, or does not answer in time.
        """
        with self._lock:
            one = self._running(state)
        deadline = time.monotonic() + PATIENCE
        while is_free(HOST, one.port):
            if one.process.poll() is not None:
                raise RigwatchError(last_line(one.said) or f"{state.rig}: the dashboard has ended")
            if time.monotonic() > deadline:
                raise RigwatchError(f"{state.rig}: no dashboard answers within {PATIENCE:g} s")
            time.sleep(_LOOK_AGAIN)
        return f"http://{HOST}:{one.port}/"

    def _running(self, state: RigState) -> _Dashboard:
        known = self._open.pop(state.rig, None)
        if known is None or known.process.poll() is not None:
            while len(self._open) >= MOST:
                self._open.pop(next(iter(self._open))).end()
            known = _started(state.config)
        self._open[state.rig] = known  # the newest last
        return known

    def close(self) -> None:
        """End all of them."""
        with self._lock:
            for one in self._open.values():
                one.end()
            self._open.clear()


def _started(config: str) -> _Dashboard:
    port, said = free_port(HOST), tempfile.TemporaryFile()  # noqa: SIM115 (open as long as it runs)
    words = ["dashboard", config, "--viewer", "web", "--port", str(port)]
    process = subprocess.Popen(
        [sys.executable, "-m", "rigwatch", *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=said,
    )
    return _Dashboard(process, said, port)
