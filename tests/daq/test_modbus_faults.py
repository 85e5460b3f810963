"""Faults of a Modbus device, by their numbers in the fault catalogue, on real servers.

Each line of the table disturbs some replies of the server. The ring in the device then gives the
samples a moment later: none may be lost, doubled or wrong.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from daq.adapters import adapter_for
from daq.adapters.modbus_poll import ModbusAdapter, RefusedError
from rigwatch.wire.device.modbus_map import Header, encode_header, encode_slot
from rigwatch.wire.errors import DeviceError, ModbusError
from rigwatch.wire.host.ports import free_port
from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.pty_bridge import PtyBridge
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.source import Device
from tests.daq.rig import Heard, Running, ToySource, codes_of, config_of, in_thread

Edit = Callable[["Replies", bytes], bytes]


class Replies:
    """Disturbs the next `left` replies of a server with `edit`."""

    def __init__(self, edit: Edit) -> None:
        self.left = 0
        self.held = b""
        self._edit = edit

    def trace(self, sending: bool, data: bytes) -> bytes:
        if not sending or (self.left == 0 and not self.held):
            return data
        self.left = max(self.left - 1, 0)
        return self._edit(self, data)


def short(_replies: Replies, data: bytes) -> bytes:
    """One register less, with lengths that agree: pymodbus takes it for good."""
    length, count = int.from_bytes(data[4:6], "big") - 2, data[8] - 2
    return data[:4] + length.to_bytes(2, "big") + data[6:8] + bytes([count]) + data[9:-2]


def late(replies: Replies, data: bytes) -> bytes:
    """Hold a reply back and send it before the next one."""
    held, replies.held = replies.held, b"" if replies.held else data
    return held + data if held else b""


def flipped(_replies: Replies, data: bytes) -> bytes:
    """A bit of the first slot's sample number, or of the identification."""
    return data[:10] + bytes([data[10] ^ 4]) + data[11:]


@dataclass(frozen=True)
class Fault:
    """Replies that are disturbed, and how often polls must have failed at least."""

    number: int
    name: str
    edit: Edit
    failed: int
    replies: int = 1
    link: str = "tcp"


FAULTS = [
    Fault(19, "no reply", lambda r, data: b"", 1),
    Fault(19, "no reply", lambda r, data: b"", 1, link="rtu"),
    Fault(19, "silent for four polls", lambda r, data: b"", 3, replies=4),
    Fault(22, "short reply", short, 1, replies=2),
    Fault(23, "bit flip", flipped, 1),
    Fault(23, "bit flip under a checksum", flipped, 1, link="rtu"),
    Fault(25, "late reply", late, 1),
    Fault(25, "late reply", late, 1, link="rtu"),
    Fault(25, "duplicate reply", lambda r, data: data + data, 0, replies=3),
    Fault(25, "duplicate reply", lambda r, data: data + data, 0, replies=3, link="rtu"),
]


@dataclass
class ModbusBench:
    """A server of a device, and the acquisition that polls it."""

    device: Device
    server: ModbusServer
    serve: Callable[[threading.Event], None]
    running: Running


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[..., ModbusBench]]:
    made = []

    def open_bench(edit: Edit | None = None, link: str = "tcp", extra: str = "") -> ModbusBench:
        device = Device(ToySource())
        replies = Replies(edit or (lambda r, data: data))
        server = ModbusServer(device, RegisterBank(3), trace=replies.trace)
        server.replies = replies  # type: ignore[attr-defined]
        port = free_port()
        if link == "tcp":
            section = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}'
            serve = lambda stop: server.run_tcp("127.0.0.1", port, stop)  # noqa: E731
        else:
            section = f'adapter = "modbus-rtu"\nport = "{tmp_path / "rtu"}"'
            serve = lambda stop: server.run_rtu(PtyBridge(tmp_path / "rtu"), stop)  # noqa: E731
        config = config_of(f"{section}\ntimeout = 0.1\n{extra}")
        adapter = adapter_for(config.daq.device, config.channels)
        made.append(Running(config, adapter))
        return ModbusBench(device, server, serve, made[-1])

    yield open_bench
    for running in made:
        running.device.close()


def every_sample_is_there_and_right(heard: Heard) -> None:
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    values = np.concatenate([block.channel("position").values for block in heard.blocks])
    np.testing.assert_array_equal(values, codes_of(np.array(numbers))[:, 1])


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f"{f.number}-{f.name}-{f.link}")
def test_fault(fault: Fault, opened: Callable[..., ModbusBench]) -> None:
    bench = opened(fault.edit, fault.link)
    with in_thread(bench.serve):
        bench.running.more(20)
        bench.server.replies.left = fault.replies  # type: ignore[attr-defined]
        heard = bench.running.more(60)
    assert bench.running.adapter.counters()["failed_polls"] >= fault.failed
    every_sample_is_there_and_right(heard)


@pytest.mark.parametrize(("code", "word"), [(2, "illegal address"), (6, "busy")])
def test_20_exception_codes_are_named(
    code: int, word: str, opened: Callable[..., ModbusBench]
) -> None:
    bench = opened()
    with in_thread(bench.serve):
        bench.running.more(20)
        bench.server.exception = code
        wanted = f"exception code {code}, {word}"
        bench.running.until(lambda heard: any(wanted in text for text in texts(heard)))
        bench.server.exception = 0
        heard = bench.running.more(20)
    every_sample_is_there_and_right(heard)


def test_21_word_order_is_checked_before_the_first_sample(
    opened: Callable[..., ModbusBench],
) -> None:
    bench = opened(extra='word_order = "little"')
    with in_thread(bench.serve):
        heard = bench.running.until(lambda h: any("word order" in e for e in texts(h)))
    assert "set word_order = 'big'" in " ".join(texts(heard))
    assert heard.count() == 0


def texts(heard: Heard) -> list[str]:
    return [event.text for event in heard.messages if hasattr(event, "text")]


def test_24_a_server_that_was_away_is_found_again(opened: Callable[..., ModbusBench]) -> None:
    bench = opened()
    with in_thread(bench.serve):
        bench.running.more(20)
    bench.running.until(lambda heard: "link_lost" in heard.events())
    with in_thread(bench.serve):
        heard = bench.running.more(20)
    assert heard.health.counters["reconnects"] >= 1 or bench.running.device.reconnects >= 1
    every_sample_is_there_and_right(heard)


@pytest.mark.parametrize("frozen_s", [0.5, 4.0])
def test_24_a_server_that_hangs_is_noticed_and_found_again(frozen_s: float) -> None:
    port = free_port()
    section = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}\ntimeout = 0.1'
    config = config_of(section)
    running = Running(config, adapter_for(config.daq.device, config.channels))
    with server_process(port) as process:
        running.more(20)
        process.send_signal(signal.SIGSTOP)
        frozen = time.monotonic()
        running.until(lambda heard: "stale" in heard.events() or "link_lost" in heard.events(), 2.0)
        while time.monotonic() < frozen + frozen_s:
            running.turn()
        process.send_signal(signal.SIGCONT)
        heard = running.more(256)
    running.device.close()
    assert heard.health.counters["failed_polls"] >= 1
    every_number_is_there_or_reported(heard)


@contextlib.contextmanager
def server_process(port: int) -> Iterator["subprocess.Popen[bytes]"]:
    """The server of `modbus_device.py`; ended however it is left."""
    root = Path(__file__).parents[2]
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.daq.modbus_device", str(port)],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGCONT)
        process.kill()
        process.wait()


def every_number_is_there_or_reported(heard: Heard) -> None:
    """Each once, delivered with its own values or in a gap."""
    delivered = [seq for _, seq in heard.numbers()]
    told = [seq for gap in heard.gaps for seq in range(gap.first, gap.last + 1)]
    assert sorted(delivered + told) == list(range(delivered[0], delivered[-1] + 1))
    values = np.concatenate([block.channel("position").values for block in heard.blocks])
    np.testing.assert_array_equal(values, codes_of(np.array(delivered))[:, 1])


def test_24_a_restarted_device_has_a_new_boot(opened: Callable[..., ModbusBench]) -> None:
    bench = opened()
    with in_thread(bench.serve):
        bench.running.more(20)
        bench.device.restart()
        heard = bench.running.until(lambda h: "boot_changed" in h.events())
        heard = bench.running.more(20)
    assert len({boot for boot, _ in heard.numbers()}) == 2
    assert heard.numbers()[-1][0] == bench.device.boot


class Still:
    """Registers that always hold the same."""

    def __init__(self, header: Header) -> None:
        self.header = header

    def open(self) -> None: ...

    def close(self) -> None: ...

    def read(self, address: int, count: int) -> list[int]:
        return encode_header(self.header)[address : address + count]


def test_another_number_of_channels_is_refused() -> None:
    adapter = ModbusAdapter(Still(Header(2, 1, 5, 0, 64)), channels=3)
    with pytest.raises(RefusedError, match="the device has 2 channels, the configuration has 3"):
        adapter.open()


class Slots(Still):
    """A ring of slots whose `fails_at`-th read from now on fails with `error`."""

    def __init__(self) -> None:
        super().__init__(Header(3, 1, 1, 0, 1024))
        self.fails_at, self.error = 0, ModbusError("no valid answer in time")

    def read(self, address: int, count: int) -> list[int]:
        self.fails_at -= 1
        if self.fails_at == 0:
            raise self.error
        if address == 0:
            return super().read(address, count)
        first = (address - self.header.address(0)) // self.header.slot_length
        slots = range(first, first + count // self.header.slot_length)
        return [word for seq in slots for word in encode_slot(seq, seq * 3906, [seq, 0, 0])]


class Busy(Slots):
    """A ring whose device takes so many samples while it is asked once."""

    def __init__(self, samples: int) -> None:
        super().__init__()
        self.every = samples

    def read(self, address: int, count: int) -> list[int]:
        slots = self.header.slots
        self.header = replace(self.header, samples=self.header.samples + self.every)
        if address == 0:
            return Still.read(self, address, count)
        first = (address - self.header.address(0)) // self.header.slot_length
        newest = self.header.samples - 1
        seqs = [
            newest - (newest - slot) % slots
            for slot in range(first, first + count // self.header.slot_length)
        ]
        return [word for seq in seqs for word in encode_slot(seq, seq * 3906, [seq, 0, 0])]


@pytest.mark.parametrize("every", [4, 10, 12])
def test_a_full_ring_is_read_of_a_device_that_goes_on_while_it_is_asked(every: int) -> None:
    registers = Busy(every)
    adapter = ModbusAdapter(registers, channels=3, sleep=lambda seconds: None, polls=1e6)
    adapter.open()
    adapter.read(1.0)
    registers.header = replace(registers.header, samples=registers.header.samples + 5000)
    read: list[int] = []
    for _ in range(20):
        with contextlib.suppress(DeviceError):
            read += [int(seq) for block in adapter.read(1.0) for seq in block.seq]
    assert read
    assert read == list(range(read[0], read[-1] + 1))
    assert registers.header.samples - read[-1] < 100


@pytest.mark.parametrize("error", [ModbusError("late"), RefusedError("no"), DeviceError("gone")])
def test_a_poll_that_fails_halfway_loses_nothing_of_what_it_has_read(error: Exception) -> None:
    registers = Slots()
    adapter = ModbusAdapter(registers, channels=3, sleep=lambda seconds: None, polls=1e6)
    adapter.open()
    before = adapter.read(1.0)
    registers.header = replace(registers.header, samples=77)
    registers.fails_at, registers.error = 4, error
    halfway = adapter.read(1.0)
    assert adapter.counters()["failed_polls"] == 1
    blocks = [*before, *halfway, *adapter.read(1.0)]
    assert [seq for block in blocks for seq in block.seq] == list(range(77))
    assert [code for block in blocks for code in block.codes[:, 0]] == list(range(77))


@pytest.mark.parametrize("error", [RefusedError("no"), DeviceError("gone")])
def test_an_error_after_which_no_poll_helps_ends_the_poll_that_reads_nothing(
    error: Exception,
) -> None:
    registers = Slots()
    adapter = ModbusAdapter(registers, channels=3, sleep=lambda seconds: None, polls=1e6)
    adapter.open()
    registers.fails_at, registers.error = 2, error
    with pytest.raises(type(error)):
        adapter.read(1.0)


def test_a_device_that_always_fails_is_given_up_and_opened_anew() -> None:
    registers = Still(Header(3, 1, 0, 0, 64))
    adapter = ModbusAdapter(registers, channels=3, sleep=lambda seconds: None, polls=1e6)
    adapter.open()
    registers.read = lambda address, count: [0] * (count - 1)  # type: ignore[method-assign]
    assert [adapter.read(1.0), adapter.read(1.0)] == [[], []]
    with pytest.raises(DeviceError, match="3 polls in a row failed, the last: a reply of 15 reg"):
        adapter.read(1.0)
    with pytest.raises(ModbusError):
        adapter.open()
