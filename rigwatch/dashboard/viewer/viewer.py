"""Rerun's viewer as a separate process: start, liveness check, end.

It listens on 127.0.0.1 only, drops its oldest data at a memory limit, ends with the process that
started it, and neither reports usage nor fetches examples from the network.
"""

import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal, Self

from rigwatch.dashboard import viewer_program
from rigwatch.dashboard.viewer.viewer_page import HOST, Page
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import end_process, free_ports, last_line

_PICTURE = "1600x1000"
_START_TIMEOUT = 30.0
_STOP_TIMEOUT = 3.0


@dataclass(frozen=True, slots=True)
class Memory:
    """Memory limits above which the oldest data are dropped, in the viewer's notation.

    Attributes:
        viewer: limit of the viewer.
        server: limit of the data kept for browsers that connect later.
    """

    viewer: str
    server: str


LIVE_MEMORY = Memory("1GiB", "256MiB")
RECORDING_MEMORY = Memory("75%", "1GiB")
Kind = Literal["native", "web", "headless"]


class ViewerError(RigwatchError):
    """The viewer cannot be started or does not answer."""


class Viewer:
    """One viewer process.

    Args:
        kind: a window, a web page, or off-screen for pictures and tests.
        port: data port; 0 for any free one.
        web_port: port for browsers; 0 for any free one.
        memory: memory limits.

    Raises:
        ViewerError: a port is taken.
    """

    def __init__(
        self, kind: Kind, port: int = 0, web_port: int = 0, memory: Memory = LIVE_MEMORY
    ) -> None:
        self.kind, self._memory = kind, memory
        free = free_ports(3, HOST)
        self.port = port or free[0]
        self.web_port = (web_port or free[1]) if kind == "web" else 0
        for taken in filter(answers, filter(None, (self.port, self.web_port))):
            raise ViewerError(f"port {taken} is taken: end what listens there or configure another")
        self._page_source = free[2] if kind == "web" else 0
        self._page: Page | None = None
        self._words: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115
        self._process = subprocess.Popen(
            [*_dying_with_parent(), str(_binary()), *self._options()],
            env=_environment(),
            stdin=subprocess.DEVNULL,
            stdout=self._words,
            stderr=self._words,
        )

    @property
    def url(self) -> str:
        """The address for data."""
        return f"rerun+http://{HOST}:{self.port}/proxy"

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def web_url(self) -> str:
        """The address for a browser."""
        return f"http://{HOST}:{self.web_port}/"

    def await_answer(self, tick: Callable[[], None] = lambda: None) -> Self:
        """Wait until it accepts data, calling `tick` meanwhile; returns itself.

        Raises:
            ViewerError: it ended, or did not answer in time.
        """
        deadline = time.monotonic() + _START_TIMEOUT
        while not answers(self.port):
            if self.exit_code() is not None or time.monotonic() > deadline:
                self.stop()
                raise ViewerError(f"the viewer did not start: {self.last_words()}")
            tick()
            time.sleep(0.05)
        if self.kind == "web":
            self._page = Page(self.web_port, self._page_source, self.port)
        return self

    def exit_code(self) -> int | None:
        """None while it runs; 0 if the user closed the window."""
        return self._process.poll()

    def stop(self) -> None:
        """End the process; kill it if it does not respond."""
        if self._page is not None:
            self._page.close()
        end_process(self._process, _STOP_TIMEOUT)

    def last_words(self) -> str:
        """The last line of its output."""
        return last_line(self._words) or "it said nothing"

    def _options(self) -> list[str]:
        options = ["--bind", HOST, "--port", str(self.port), "--hide-welcome-screen"]
        options += ["--memory-limit", self._memory.viewer]
        options += ["--server-memory-limit", self._memory.server]
        kind = {
            "native": ["--expect-data-soon"],
            "headless": ["--headless", "--window-size", _PICTURE],
            "web": ["--serve-web", "--web-viewer-port", str(self._page_source)],
        }
        return options + kind[self.kind]


class ForeignViewer:
    """A viewer that another process on this machine has started.

    Args:
        port: its data port.
    """

    def __init__(self, port: int) -> None:
        self.port = port
        self.url = f"rerun+http://{HOST}:{port}/proxy"

    def exit_code(self) -> int | None:
        """None while it answers, 1 afterwards."""
        return None if answers(self.port) else 1

    def stop(self) -> None:
        """Leave it running."""


def has_display() -> bool:
    """Whether a window can be opened."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def answers(port: int) -> bool:
    """Whether a process listens on a port of this machine."""
    with socket.socket() as probe:
        probe.settimeout(0.5)
        return probe.connect_ex((HOST, port)) == 0


def _binary() -> Path:
    if (program := viewer_program()) is None:
        raise ViewerError("the package rerun-sdk is incomplete: its viewer is missing")
    return program


def _environment() -> dict[str, str]:
    """The environment of the viewer: CI switches off its usage reports for one process."""
    return {**os.environ, "CI": "true", "RERUN_APP_ONLY": "true", "RUST_LOG": "warn"}


def _dying_with_parent() -> list[str]:
    """The command prefix that ends the viewer when its parent is killed; empty if unavailable."""
    tool = shutil.which("setpriv")
    return [tool, "--pdeathsig", "TERM", "--"] if tool else []
