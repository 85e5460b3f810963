"""Rigs whose blocks are taken together say what each says alone, to the last byte."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from daq import chain as chains
from daq.adapters.serial_line import SerialAdapter
from daq.chain import Chain
from daq.together import Lane
from daq.watch import Link
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.device import Frame, encode
from rigwatch.wire.errors import DeviceError
from rigwatch.wire.host import Heartbeat
from rigwatch.wire.messages import RING_KEY, TOPICS
from rigwatch.wire.ordering import Ask
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.bus.rig import ROOT

RATE, CHANNELS, CYCLE_NS = 256.0, 3, 35_000_000
PERIOD_US = 1e6 / RATE
CYCLES = 900
BEGIN_NS, UNIX_NS = 5_000_000_000, 1_700_000_000_000_000_000
LOST = b"the line is gone"


class Clock:
    """Stands for the module `time` in chains."""

    def __init__(self) -> None:
        self.now_ns = BEGIN_NS

    def monotonic_ns(self) -> int:
        return self.now_ns


@dataclass
class Device:
    """Sends frames, and what `fate` says happens to them on their way."""

    random: np.random.Generator
    boot: int
    seq: int
    fates: tuple[str, ...]
    us: float = 0.0
    past: list[Frame] = field(default_factory=list)

    def sent(self) -> bytes:
        """The bytes of a cycle."""
        frames = [self._frame() for _ in range(int(self.random.integers(6, 13)))]
        fate = str(self.random.choice(self.fates)) if self.random.random() < 0.08 else ""
        cut = int(self.random.integers(1, len(frames)))
        if fate == "gap":
            del frames[cut]
        elif fate == "again":
            frames[cut:cut] = self.past[-3:]
        elif fate == "boot":
            self.boot, self.seq, self.us = int(self.random.integers(1, 2**32)), 0, 0.0
            frames[cut:] = [self._frame() for _ in frames[cut:]]
        elif fate == "recount":
            self.seq = 0
        elif fate == "jump":
            self.us += 70_000
        elif fate == "rail":
            frames[cut:] = [replace(one, codes=(32767, -32768, 5)) for one in frames[cut:]]
        elif fate == "stranger":
            frames.insert(cut, Frame(77, 5, 5, frames[0].codes))
        self.past = frames
        data = b"".join(map(encode, frames))
        if fate == "noise":
            return data[:cut] + bytes(self.random.integers(0, 256, 40).tolist()) + data[cut:]
        if fate == "flip":
            return data[:cut] + bytes([data[cut] ^ 4]) + data[cut + 1 :]
        return {"pause": b"", "gone": LOST}.get(fate, data)

    def _frame(self) -> Frame:
        self.seq, self.us = self.seq + 1, self.us + PERIOD_US * (1.0 + 2e-5)
        codes = np.rint(9000 * np.sin(0.05 * self.seq + np.arange(CHANNELS)))
        codes += self.random.integers(-20, 20, CHANNELS)
        return Frame(
            self.boot, self.seq % 2**32, round(self.us) % 2**32, tuple(codes.astype(int).tolist())
        )


class Line:
    """Ends a cycle's bytes anywhere, as lines do."""

    def __init__(self, random: np.random.Generator) -> None:
        self.waiting, self._random = b"", random

    def open(self) -> None:
        """It is open."""

    def put(self, data: bytes) -> None:
        self.waiting = data if data == LOST else self.waiting + data

    def read(self, _: float) -> bytes:
        if self.waiting == LOST:
            self.waiting = b""
            raise DeviceError("the line was closed at its other end")
        until = len(self.waiting) - int(self._random.integers(0, 30))
        data, self.waiting = self.waiting[: max(0, until)], self.waiting[max(0, until) :]
        return data

    def close(self) -> None:
        """Nothing to close."""


class World:
    """The chains of several rigs on a bus of their own, and all that was said there."""

    def __init__(self, configs: list[RigConfig], clock: Clock) -> None:
        self.network, self.said = MemoryNetwork(), Counter[str]()
        self.heard: list[tuple[str, bytes]] = []
        self.unix_ns = UNIX_NS
        self.lines = [Line(np.random.default_rng(n)) for n in range(len(configs))]
        self.chains: list[Chain] = []
        for config, line in zip(configs, self.lines, strict=True):
            self._listen(config.rig.id)
            adapter = SerialAdapter(line, CHANNELS, clock.monotonic_ns)
            bus = self.network.bus(config.rig.id, "daq")
            chain = Chain(config, adapter, bus, Heartbeat("daq"))
            chain.acquisition._host_offset_ns = lambda: self.unix_ns
            chain.acquisition.clock.follow(self.unix_ns, BEGIN_NS)
            chain.device._clock = lambda: clock.now_ns * 1e-9
            chain.device.start()
            self.chains.append(chain)

    def _listen(self, rig: str) -> None:
        bus = self.network.bus(rig, "listener")
        for topic in TOPICS:
            for key in topic.keys:
                bus.transport.listen_from(
                    bus.key(key), lambda data, *_, of=f"{rig}/{key}": self.heard.append((of, data))
                )

    def ring(self, number: int, boot: int) -> list[bytes]:
        """What the ring of a rig has of a boot."""
        bus = self.network.bus(f"rig{number}", "asker")
        return [
            reply
            for first in range(0, 4096, 512)
            for reply in bus.query(RING_KEY, Ask(boot, first, first + 511).to_bytes())
        ]


def devices() -> Iterator[Device]:
    everything = (
        "gap", "again", "boot", "recount", "jump", "rail", "stranger", "noise", "flip", "pause",
        "gone",
    )  # fmt: skip
    of_rigs = [("rail",), everything, ("gap", "pause"), everything, ("jump",)]
    for number, fates in enumerate(of_rigs):
        seq = 2**32 - 4000 if number == 2 else 100 * number
        yield Device(np.random.default_rng(50 + number), 40 + number, seq, fates)


def configs(folder: Path) -> list[RigConfig]:
    text = (ROOT / "configs" / "demo.toml").read_text()
    found = []
    for number in range(5):
        path = folder / f"rig{number}.toml"
        path.write_text(text.replace('id = "demo"', f'id = "rig{number}"'))
        found.append(load_rig(path))
    return found


def test_each_rig_says_what_it_says_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock, taken = Clock(), Counter[int]()
    monkeypatch.setattr(chains, "time", clock)
    rigs = configs(tmp_path)
    alone, together, lane = World(rigs, clock), World(rigs, clock), Lane()
    boots: list[set[int]] = [set() for _ in rigs]
    sending = list(devices())
    for cycle in range(CYCLES):
        clock.now_ns += CYCLE_NS
        for number, device in enumerate(sending):
            data = device.sent()
            boots[number].add(device.boot)
            for world in (alone, together):
                world.lines[number].put(data)
        if cycle in {500, 600}:
            step_ns = 3_000_000_000 * (1 if cycle == 500 else -2)
            alone.unix_ns, together.unix_ns = UNIX_NS + step_ns, UNIX_NS + step_ns
        lane.take(together.chains)
        for number, (single, mine) in enumerate(zip(alone.chains, together.chains, strict=True)):
            taken[number] += mine.taken
            single.step(0.0)
            mine.step(0.0)
        assert _by_key(together.heard) == _by_key(alone.heard), cycle
        alone.heard.clear()
        together.heard.clear()
    for number, (single, mine) in enumerate(zip(alone.chains, together.chains, strict=True)):
        assert mine.adapter.counters() == single.adapter.counters()
        assert mine.device.link == single.device.link == Link(True, "", single.device.reconnects)
        assert _state(mine) == _state(single)
        for boot in boots[number]:
            assert together.ring(number, boot) == alone.ring(number, boot)
    assert all(taken[number] > 0.8 * CYCLES for number in (0, 2, 4))
    assert all(0.5 * CYCLES < taken[number] < 0.95 * CYCLES for number in (1, 3))


def _by_key(heard: list[tuple[str, bytes]]) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {}
    for key, data in heard:
        found.setdefault(key, []).append(data)
    return found


def _state(chain: Chain) -> list[object]:
    of = chain.acquisition
    numbers = [of.tracker.count, of.clock.place, of.clock.line, of.conditioner.states.channels]
    kept = [of.samples, of.watch.state, of.watch._samples, dict(of.watch._flagged)]
    return [*[one.tolist() for one in numbers], *kept, of.clock._finished.rows.tolist()]


def test_one_that_fails_at_the_tables_fails_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, lane = Clock(), Lane()
    monkeypatch.setattr(chains, "time", clock)
    world = World(configs(tmp_path), clock)
    sending = [Device(np.random.default_rng(n), 40 + n, 0, ("",)) for n in range(5)]
    for cycle in range(40):
        clock.now_ns += CYCLE_NS
        for line, device in zip(world.lines, sending, strict=True):
            line.put(device.sent())
        if cycle == 20:
            monkeypatch.setattr(world.lines[1], "read", lambda _: 1 / 0)
            monkeypatch.setattr(world.chains[3].publisher, "publish_kept", lambda _: 1 / 0)
        lane.take(world.chains)
        for number, chain in enumerate(world.chains):
            if cycle >= 20 and number in {1, 3}:
                with pytest.raises(ZeroDivisionError):
                    chain.step(0.0)
            else:
                assert chain.taken == (cycle > 0)
                chain.step(0.0)
