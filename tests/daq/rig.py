"""A small rig for tests: a source of codes, real lines, and the acquisition at their other end."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from daq.acquisition import Acquisition
from daq.adapter import Adapter
from daq.adapters.serial_line import SerialAdapter, SerialPort
from daq.supervisor import Supervisor
from rigwatch.wire.messages.message_types import Event, Gap, Health, Message, SampleBlock
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.typed_files.loading import parse
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device

RATE = 256.0


@dataclass
class Codes:
    """What the toy source hands over for n samples."""

    seq: Any
    device_us: Any
    codes: Any


class ToySource:
    """Three channels that move: sample s is known from its number alone.

    `edit(seq, codes)` may change the codes, shape (n, 3), in place.
    """

    def __init__(self) -> None:
        self._next = 0
        self.edit: Callable[[Any, Any], None] = lambda seq, codes: None

    def advance(self, n: int) -> Codes:
        seq = np.arange(self._next, self._next + n)
        self._next += n
        codes = codes_of(seq)
        self.edit(seq, codes)
        return Codes(seq, np.rint(seq * 1e6 / RATE).astype(np.int64), codes)


def codes_of(seq: Any) -> Any:
    """Codes of the samples `seq`, shape (n, 3)."""
    phase = 2 * np.pi * 5.0 * np.asarray(seq) / RATE
    columns = [8000 * np.sin(phase), 6000 * np.cos(phase), 500 * (np.asarray(seq) % 32 - 16)]
    return np.stack(columns, axis=1).astype(np.int16)


def config_of(device: str, channels: int = 3, position: str = "") -> RigConfig:
    """A rig whose [daq.device] is `device`, with channels that have codes for values.

    `position` has further keys of the channel of that name.
    """
    names = ["voltage", "position", "acceleration", "force"][:channels]
    tables = "".join(
        f'[[channels]]\nname = "{n}"\nunit = "V"\ngain = 1.0\n{position * (n == "position")}\n'
        for n in names
    )
    text = f'[rig]\nid = "test"\n{tables}\n[daq.device]\n{device}\n'
    return parse(text, RigConfig, "test.toml")


@dataclass
class Heard:
    """Messages by kind, in order."""

    messages: list[Message] = field(default_factory=list)

    def of(self, kind: type[Any]) -> list[Any]:
        return [message for message in self.messages if isinstance(message, kind)]

    @property
    def blocks(self) -> list[SampleBlock]:
        return self.of(SampleBlock)

    @property
    def gaps(self) -> list[Gap]:
        return self.of(Gap)

    @property
    def health(self) -> Health:
        return self.of(Health)[-1]  # type: ignore[no-any-return]

    def events(self) -> list[str]:
        return [event.code for event in self.of(Event)]

    def text(self, code: str) -> str:
        return next(e.text for e in reversed(self.of(Event)) if e.code == code)

    def numbers(self) -> list[tuple[int, int]]:
        return [(b.boot, b.seq + i) for b in self.blocks for i in range(len(b))]

    def count(self) -> int:
        return sum(map(len, self.blocks))

    def lost(self) -> int:
        return sum(gap.last - gap.first + 1 for gap in self.gaps if gap.last >= gap.first)


class Running:
    """Adapter, supervisor and acquisition as the process runs them, without a bus."""

    def __init__(
        self, config: RigConfig, adapter: Adapter, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self.adapter = adapter
        self.clock = clock
        sleep = time.sleep if clock is time.monotonic_ns else (lambda seconds: None)
        self.device = Supervisor(adapter, clock=lambda: clock() * 1e-9, sleep=sleep)
        self.acquisition = Acquisition(config, adapter.clock_rate)
        self.heard = Heard()

    def turn(self) -> None:
        for raw in self.device.read(self.acquisition.patience(self.clock())):
            self.heard.messages += self.acquisition.update(raw)
        self.tick()

    def tick(self) -> None:
        link, counters = self.device.link, self.adapter.counters()
        self.heard.messages += self.acquisition.tick(self.clock(), link, counters)

    def until(self, holds: Callable[["Heard"], bool], timeout: float = 30.0) -> Heard:
        """Run until `holds(heard)`; fails when that takes longer than `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while not holds(self.heard):
            said = [e.text for e in self.heard.of(Event)]
            assert time.monotonic() < deadline, f"never happened; heard {said}"
            self.turn()
        return self.heard

    def more(self, samples: int, timeout: float = 30.0) -> Heard:
        """Run until so many more samples have come."""
        wanted = self.heard.count() + samples
        return self.until(lambda heard: heard.count() >= wanted, timeout)


class HostTime:
    """A host's monotonic clock that a test moves [ns]."""

    def __init__(self) -> None:
        self.ns = 10**12

    def __call__(self) -> int:
        return self.ns

    def pass_by(self, seconds: float) -> None:
        self.ns += round(seconds * 1e9)


class SerialBench:
    """The simulated device on a real pty, sent sample by sample at the pace of a test's clock."""

    def __init__(
        self,
        folder: Path,
        config: Callable[[str], RigConfig] = lambda port: config_of(_serial(port)),
        first_seq: int = 0,
        pattern: str = "rig",
    ) -> None:
        self.time = HostTime()
        self.source = ToySource()
        self.device = Device(self.source, first_seq=first_seq)
        self.faults = LineFaults()
        self.line = PtyLine(folder / "rig")
        self.server = SerialServer(self.device, self.line, faults=self.faults)
        self.line.plug()
        port = SerialPort(str(folder / pattern), 115200)
        self.config = config(str(folder / pattern))
        adapter = SerialAdapter(port, len(self.config.channels), self.time)
        self.running = Running(self.config, adapter, self.time)
        self.running.device.start()

    @property
    def heard(self) -> Heard:
        return self.running.heard

    def play(self, samples: int, period: float = 1.0 / RATE) -> Heard:
        """Send samples, each a `period` after the one before, and hear what comes of them."""
        for _ in range(samples):
            self.time.pass_by(period)
            self.server.step(1)
            self.running.turn()
        return self.heard

    def silence(self, seconds: float) -> Heard:
        """Let time pass in which the device says nothing."""
        for _ in range(round(seconds / 0.01)):
            self.time.pass_by(0.01)
            self.running.turn()
        return self.heard

    def settle(self, samples: int = 8) -> Heard:
        """Send on until the newest sample has come through."""
        for _ in range(400):
            newest = self.play(1).numbers()[-1:]
            if newest and newest[0][1] % 2**32 == (self.device.next_seq - 1) % 2**32:
                return self.play(samples)
        raise AssertionError("samples never came back")

    def close(self) -> None:
        self.running.device.close()
        self.line.unplug()


def _serial(port: str) -> str:
    return f'adapter = "serial"\nport = "{port}"'


@contextmanager
def in_thread(serve: Callable[[threading.Event], None]) -> Iterator[threading.Event]:
    """Run `serve(stop)` beside the test; its error fails the test."""
    stop, errors = threading.Event(), list[BaseException]()

    def run() -> None:
        try:
            serve(stop)
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield stop
    finally:
        stop.set()
        thread.join(5.0)
    assert not thread.is_alive()
    assert not errors, errors
