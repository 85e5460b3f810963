"""A whole rig on this machine for benchmarks: real processes, a real serial line, a real router."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.demo.commissioning import ensure_model
from rigwatch.demo.rig_file import write_rig_file
from rigwatch.keys import Authority
from rigwatch.wire.access import ROLES
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.typed_files import find_config
from tests.waiting import wait_until

if TYPE_CHECKING:
    from tests.tooling.test_up import Rig as Up

ROOT = Path(__file__).parents[2]
START_TIMEOUT = 60.0


class LiveRig:
    """Processes of one rig, all ended on leaving.

    Args:
        folder: for configuration, model and recordings.
        needs_model: commission the simulated rig first, as the demonstration does.
        tls: with keys, so that all processes speak over mutual TLS.
    """

    def __init__(self, folder: Path, *, needs_model: bool = True, tls: bool = False) -> None:
        self.folder = folder
        self.path = write_rig_file(find_config("demo.toml"), folder, "web")
        _set_apart(self.path)
        if needs_model:
            ensure_model(self.path, folder, lambda _: None)
        if tls:
            _secure(self.path, folder / "keys")
        self.config: RigConfig = load_rig(self.path)
        self._running: list[subprocess.Popen[bytes]] = []

    def start(self, *arguments: str) -> "subprocess.Popen[bytes]":
        """`python ARGUMENTS` from the repository's root."""
        process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._running.append(process)
        return process

    def command(self, name: str) -> "subprocess.Popen[bytes]":
        """`rigwatch NAME CONFIG`."""
        return self.start("-m", "rigwatch", name, str(self.path))

    def wait_for(self, *names: str) -> None:
        """Wait until processes of these names are on the bus."""
        bus = connect(self.config, "benchmark", START_TIMEOUT)
        wanted = {f"alive/{name}" for name in names}
        there = wait_until(lambda: wanted <= set(bus.tokens("alive/*")), START_TIMEOUT, 0.1)
        bus.close()
        if not there:
            raise TimeoutError(f"not all of {', '.join(names)} came up")

    def close(self) -> None:
        """End all processes, by a signal first and by a kill if necessary."""
        for process in reversed(self._running):
            process.send_signal(signal.SIGTERM)
        deadline = time.monotonic() + 5.0
        for process in self._running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(max(0.1, deadline - time.monotonic()))
            process.kill()
            process.wait()


class Statuses:
    """The newest status of the supervisor, read in a thread."""

    def __init__(self, up: "Up") -> None:
        self._up, self._newest = up, dict[str, Any]()
        threading.Thread(target=self._follow, daemon=True).start()

    def _follow(self) -> None:
        with contextlib.suppress(AssertionError):
            while True:
                self._newest = self._up.wait_for("status", 120.0)["processes"]
                self._up.events.clear()

    def of(self, name: str) -> dict[str, Any]:
        """What it says of one process."""
        return dict(self._newest.get(name, {}))

    def alive(self, name: str) -> bool:
        """Whether the process of the newest status exists."""
        pid = int(self.of(name).get("pid", 0))
        return pid > 0 and Path(f"/proc/{pid}").exists()

    def wait(self, names: tuple[str, ...], longest: float) -> None:
        """Wait until all processes of these names exist.

        Raises:
            TimeoutError: not within `longest` [s].
        """
        deadline = time.monotonic() + longest
        while not all(self.alive(name) for name in names):
            if time.monotonic() > deadline:
                raise TimeoutError(f"not all of {', '.join(names)} came up")
            time.sleep(0.2)


def _set_apart(path: Path) -> None:
    """A free port and a unique name, to avoid other rigs on this machine."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    text = re.sub(r"tcp/127\.0\.0\.1:\d+", f"tcp/127.0.0.1:{port}", path.read_text())
    path.write_text(re.sub(r'(?m)^id = ".*"$', f'id = "bench-{os.getpid()}"', text, count=1))


def _secure(path: Path, keys: Path) -> None:
    """Issue keys and use them."""
    text = path.read_text().replace("tcp/127.0.0.1", "tls/127.0.0.1")
    path.write_text(re.sub(r'(?m)^keys = ""', f'keys = "{keys}"', text, count=1))
    authority = Authority.create(keys, load_rig(path).rig.id)
    for role in ROLES:
        authority.issue(role, role)


@contextlib.contextmanager
def live_rig(*, needs_model: bool = True, tls: bool = False) -> Iterator[LiveRig]:
    """A rig in a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="rigwatch-bench-") as folder:
        rig = LiveRig(Path(folder), needs_model=needs_model, tls=tls)
        try:
            yield rig
        finally:
            rig.close()
