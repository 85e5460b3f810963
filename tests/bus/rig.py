"""A real rig's bus for tests: router, publishers and proxies as processes on loopback."""

import asyncio
import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.waiting import PATIENCE, eventually

ROOT = Path(__file__).parents[2]

CONFIG = """
[rig]
id = "bench"

[bus]
router = "tcp/127.0.0.1:{router}"
listen = "tcp/127.0.0.1:{listen}"
lease = {lease}

[[channels]]
name = "voltage"
unit = "V"
gain = 0.001

[[channels]]
name = "position"
unit = "m"
gain = 0.001

[[channels]]
name = "acceleration"
unit = "m/s^2"
gain = 0.001

[daq.device]
adapter = "serial"
port = "/dev/null"
"""


def rigwatch(*arguments: str) -> "subprocess.CompletedProcess[str]":
    """A command as a user types it, once it has ended."""
    return subprocess.run(
        [sys.executable, "-m", "rigwatch", *arguments],
        cwd=ROOT, capture_output=True, text=True, timeout=2 * PATIENCE, check=False,
    )  # fmt: skip


def free_port() -> int:
    """A TCP port that nobody has now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class TestRig:
    """A configuration in a folder, and the processes started with it; ends them when left."""

    __test__ = False

    def __init__(self, folder: Path, extra: str = "", lease: float = 10.0) -> None:
        self.folder = folder
        self.lease = lease
        self.listen = free_port()
        self.path = self.configure("rig.toml", self.listen, extra)
        self.config = load_rig(self.path)
        self._processes: list[subprocess.Popen[bytes]] = []
        self._buses: list[Bus] = []

    def __enter__(self) -> "TestRig":
        return self

    def __exit__(self, *_: object) -> None:
        for bus in self._buses:
            bus.close()
        for process in self._processes:
            kill(process)

    def configure(self, name: str, router: int, extra: str = "") -> Path:
        """A configuration whose processes reach the router through the port `router`."""
        path = self.folder / name
        bus = {"router": router, "listen": self.listen, "lease": self.lease}
        path.write_text(CONFIG.format(**bus) + extra)
        return path

    def start(self, *arguments: str) -> "subprocess.Popen[bytes]":
        """A Python process with these arguments, run from the repository's root."""
        process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process

    def router(self) -> "subprocess.Popen[bytes]":
        """A router, listening."""
        process = self.start("-m", "rigwatch", "router", str(self.path))
        eventually(lambda: answers(self.listen), "the router listens")
        return process

    def publisher(
        self, boot: int, *options: str, path: Path | None = None
    ) -> "subprocess.Popen[bytes]":
        """A process that publishes samples of `boot` at 256 Hz, from seq 0."""
        return self.start("-m", "tests.bus.publisher", str(path or self.path), str(boot), *options)

    def proxy(self, port: int = 0) -> "tuple[subprocess.Popen[bytes], int]":
        """A TCP proxy before the router, and its port."""
        port = port or free_port()
        process = self.start("-m", "tests.bus.rig", str(port), str(self.listen))
        eventually(lambda: answers(port), "the proxy listens")
        return process, port

    def bus(self, process: str, config: RigConfig | None = None) -> Bus:
        """A place on the bus, in this process."""
        bus = connect(config or self.config, process, PATIENCE)
        self._buses.append(bus)
        return bus


def answers(port: int) -> bool:
    """Whether somebody listens at `port`."""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
        return True
    return False


def kill(process: "subprocess.Popen[bytes]") -> None:
    """kill -9, also of a stopped process: it does not get to run once more."""
    process.kill()
    process.wait()


@contextlib.contextmanager
def stopped(process: "subprocess.Popen[bytes]") -> Iterator[None]:
    """The process hangs: its connections stay open and nothing goes through."""
    process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        process.send_signal(signal.SIGCONT)


async def _serve_proxy(port: int, target: int) -> None:
    async def pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                writer.write(data)
                await writer.drain()
        writer.close()

    async def joined(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", target)
        except OSError:
            writer.close()
            return
        await asyncio.gather(pump(reader, far_writer), pump(far_reader, writer))

    server = await asyncio.start_server(joined, "127.0.0.1", port)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(_serve_proxy(int(sys.argv[1]), int(sys.argv[2])))
