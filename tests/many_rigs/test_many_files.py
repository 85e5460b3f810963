"""Devices whose descriptors lie above 1023, as in a process of several hundred rigs."""

import os
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq.adapters import adapter_for
from rigwatch.wire.host import ready_to_read, write_within
from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.daq.rig import Heard, Running, ToySource, config_of, in_thread
from tests.daq.test_modbus_path import Served, served_rtu, served_tcp

MOST_OF_SELECT, ENOUGH = 1024, 1200


def serial(folder: Path) -> Served:
    port = str(folder / "rig")
    server = SerialServer(Device(ToySource()), PtyLine(port))
    return f'adapter = "serial"\nport = "{port}"', server.run


def modbus(folder: Path, served: Callable[[ModbusServer, Path], Served]) -> Served:
    return served(ModbusServer(Device(ToySource()), RegisterBank(3)), folder)


@contextmanager
def many_files() -> Iterator[None]:
    """Every descriptor below 1024 is in use."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < ENOUGH:
        pytest.skip(f"this account may open {hard} files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, ENOUGH), hard))
    held = [os.open(os.devnull, os.O_RDONLY)]
    try:
        while held[-1] < MOST_OF_SELECT:
            held.append(os.dup(held[0]))
        yield
    finally:
        for descriptor in held:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.parametrize(
    "served",
    [
        pytest.param(serial, id="serial"),
        pytest.param(lambda folder: modbus(folder, served_tcp), id="modbus-tcp"),
        pytest.param(lambda folder: modbus(folder, served_rtu), id="modbus-rtu"),
    ],
)
def test_a_device_is_read_at_any_descriptor(
    served: Callable[[Path], Served], tmp_path: Path
) -> None:
    section, serve = served(tmp_path)
    config = config_of(section)

    def read(samples: int) -> Heard:
        running = Running(config, adapter_for(config.daq.device, config.channels))
        try:
            return running.more(samples)
        finally:
            running.device.close()

    with in_thread(serve):
        read(1)  # the device's own files are open now
        with many_files():
            heard = read(50)
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert heard.lost() == 0


def test_a_line_that_takes_nothing_is_waited_for_no_longer_than_said() -> None:
    read, write = os.pipe()
    os.set_blocking(write, False)
    try:
        assert ready_to_read((read,), 0.0) == []
        size = write_within(write, bytes(1 << 20), 0.05)
        assert 0 < size < 1 << 20
        assert write_within(write, b"more", 0.05) == 0
        assert ready_to_read((read,), 0.0) == [read]
        os.close(read)
        with pytest.raises(BrokenPipeError):
            write_within(write, b"more", 0.05)
    finally:
        os.close(write)
