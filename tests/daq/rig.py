"""A small rig for tests: a source of codes, real lines, and the acquisition at their other end."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daq.acquisition import Acquisition
from daq.adapter import Adapter
from daq.supervisor import Supervisor
from rigwatch.wire.config import parse
from rigwatch.wire.messages import Event, Gap, Health, Message, SampleBlock
from rigwatch.wire.rig_config import RigConfig

RATE = 256.0


@dataclass
class Codes:
    """What the toy source hands over for n samples."""

    seq: Any
    device_us: Any
    codes: Any


class ToySource:
    """Three channels that move: sample s is known from its number alone."""

    def __init__(self) -> None:
        self._next = 0

    def advance(self, n: int) -> Codes:
        seq = np.arange(self._next, self._next + n)
        self._next += n
        return Codes(seq, np.rint(seq * 1e6 / RATE).astype(np.int64), codes_of(seq))


def codes_of(seq: Any) -> Any:
    """Codes of the samples `seq`, shape (n, 3)."""
    phase = 2 * np.pi * 5.0 * np.asarray(seq) / RATE
    columns = [8000 * np.sin(phase), 6000 * np.cos(phase), 500 * (np.asarray(seq) % 32 - 16)]
    return np.stack(columns, axis=1).astype(np.int16)


def config_of(device: str, channels: int = 3, extra: str = "") -> RigConfig:
    """A rig whose [daq.device] is `device`, with channels that have codes for values."""
    names = ["voltage", "position", "acceleration", "force"][:channels]
    tables = "".join(f'[[channels]]\nname = "{n}"\nunit = "V"\ngain = 1.0\n' for n in names)
    text = f'[rig]\nid = "test"\n{tables}{extra}\n[daq.device]\n{device}\n'
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

    def __init__(self, config: RigConfig, adapter: Adapter) -> None:
        self.adapter = adapter
        self.device = Supervisor(adapter)
        self.acquisition = Acquisition(config, adapter.clock_rate)
        self.heard = Heard()

    def turn(self) -> None:
        now = time.monotonic_ns()
        for raw in self.device.read(self.acquisition.patience(now)):
            self.heard.messages += self.acquisition.update(raw)
        now = time.monotonic_ns()
        self.heard.messages += self.acquisition.tick(
            now, self.device.link, self.adapter.counters()
        )

    def until(self, holds: Callable[["Heard"], bool], timeout: float = 5.0) -> Heard:
        """Run until `holds(heard)`; fails when that takes longer than `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while not holds(self.heard):
            said = [e.text for e in self.heard.of(Event)]
            assert time.monotonic() < deadline, f"never happened; heard {said}"
            self.turn()
        return self.heard

    def more(self, samples: int, timeout: float = 5.0) -> Heard:
        """Run until so many more samples have come."""
        wanted = self.heard.count() + samples
        return self.until(lambda heard: heard.count() >= wanted, timeout)


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
