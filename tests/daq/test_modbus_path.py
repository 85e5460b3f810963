"""From the device's ring over real Modbus servers to calibrated samples."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from daq.adapters import adapter_for
from daq.adapters.identification import Identification
from daq.adapters.modbus_poll import ModbusAdapter, RefusedError
from daq.known_device import KnownDevice
from rigwatch.wire.errors import DeviceError, ModbusError
from rigwatch.wire.host.ports import free_port
from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.pty_bridge import PtyBridge
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.source import Device
from tests.daq.rig import (
    Heard,
    HostTime,
    Running,
    ToySource,
    codes_of,
    config_of,
    in_thread,
)
from tests.waiting import eventually

Served = tuple[str, Callable[..., None]]


def served_tcp(server: ModbusServer, _folder: Path) -> Served:
    port = free_port()
    device = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}'
    return device, lambda stop: server.run_tcp("127.0.0.1", port, stop)


def served_rtu(server: ModbusServer, folder: Path) -> Served:
    device = f'adapter = "modbus-rtu"\nport = "{folder / "rtu"}"'
    return device, lambda stop: server.run_rtu(PtyBridge(folder / "rtu"), stop)


@pytest.mark.parametrize("served", [served_tcp, served_rtu])
def test_of_another_device_no_sample_is_taken(
    served: Callable[[ModbusServer, Path], Served], tmp_path: Path
) -> None:
    server = ModbusServer(Device(ToySource()), RegisterBank(3), identity="RX-2 no. 4711")
    section, serve = served(server, tmp_path)

    def opened(identity: str) -> ModbusAdapter:
        config = config_of(f'{section}\nidentity = "{identity}"')
        adapter = adapter_for(config.daq.device, config.channels)
        assert isinstance(adapter, ModbusAdapter)
        eventually(lambda: is_there(adapter), "the device")
        return adapter

    def is_there(adapter: ModbusAdapter) -> bool:
        try:
            adapter.open()
        except RefusedError:
            adapter.close()
            raise
        except (DeviceError, ModbusError):
            return False
        return True

    with in_thread(serve):
        opened("4711").close()
        with pytest.raises(RefusedError, match=r"another device, 'rigwatch, simulated rig, .*4711"):
            opened("no. 4712")


@pytest.mark.parametrize("served", [served_tcp, served_rtu])
@pytest.mark.parametrize("order", ["big", "little"])
def test_every_sample_arrives_once_with_its_codes(
    served: Callable[[ModbusServer, Path], Served], order: str, tmp_path: Path
) -> None:
    server = ModbusServer(Device(ToySource()), RegisterBank(3, order))
    section, serve = served(server, tmp_path)
    config = config_of(f'{section}\nword_order = "{order}"')
    with in_thread(serve):
        running = Running(config, adapter_for(config.daq.device, config.channels))
        heard = running.more(100)
        running.device.close()
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    values = np.concatenate([block.channel("position").values for block in heard.blocks])
    np.testing.assert_array_equal(values, codes_of(np.array(numbers))[:, 1])
    assert heard.lost() == 0


class BankRegisters:
    """A device's registers without a line between."""

    def __init__(self, bank: RegisterBank) -> None:
        self.read = bank.read

    def open(self) -> None: ...

    def close(self) -> None: ...


def polled(device: Device, steps: list[int]) -> Heard:
    """Poll a device that takes `steps` samples between the polls."""
    bank, time = RegisterBank(3), HostTime()
    bank.add(device.advance(1))
    adapter = ModbusAdapter(BankRegisters(bank), 3, clock=time, sleep=time.pass_by)
    running = Running(config_of('adapter = "modbus-tcp"\nhost = "x"'), adapter, time)
    for step in steps:
        bank.add(device.advance(step))
        time.pass_by(max(step / 256, 1 / 32))
        running.turn()
    return running.heard


def test_counters_wrap_without_a_loss() -> None:
    heard = polled(Device(ToySource(), first_seq=2**32 - 50, first_us=2**32 - 10**5), [8] * 20)
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], 2**32 - 49 + 160))
    device_us = np.concatenate([block.device_us for block in heard.blocks])
    assert (np.diff(device_us) > 3900).all()


def test_what_the_ring_has_lost_is_counted_exactly() -> None:
    heard = polled(Device(ToySource()), [8, 8, 2000, 8])
    numbers = [seq for _, seq in heard.numbers()]
    assert len(numbers) + heard.lost() == numbers[-1] - numbers[0] + 1
    assert heard.lost() == 2000 - (512 - 8)


def test_a_device_that_takes_another_s_place_on_an_open_line_is_checked() -> None:
    first, second = Device(ToySource()), Device(ToySource())
    banks = RegisterBank(3), RegisterBank(3)
    for device, bank in zip((first, second), banks, strict=True):
        bank.add(device.advance(10))
    time, told = HostTime(), {0: "RX-2", 0x80: "no. 4711"}
    registers = BankRegisters(banks[0])
    who = Identification(lambda: told, "", "the device")
    adapter = ModbusAdapter(registers, 3, clock=time, sleep=time.pass_by, who=who)
    adapter.check_against(KnownDevice("daq", None))
    adapter.open()
    for _ in range(3):
        time.pass_by(1 / 32)
        adapter.read(1.0)
    told[0x80], registers.read = "no. 4712", banks[1].read
    time.pass_by(1 / 32)
    with pytest.raises(RefusedError, match=r"another device, 'RX-2, no. 4712', expected .*4711"):
        adapter.read(1.0)
    told[0x80] = "no. 4711"  # the same device, started anew
    time.pass_by(1 / 32)
    assert {block.boot for block in adapter.read(1.0)} == {second.boot} != {first.boot}
