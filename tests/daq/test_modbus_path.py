"""From the device's ring over real Modbus servers to calibrated samples."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from daq.adapters import adapter_for
from rigwatch.wire.ports import free_port
from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.pty_bridge import PtyBridge
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.source import Device
from tests.daq.rig import Running, ToySource, codes_of, config_of, in_thread

Served = tuple[str, Callable[..., None]]


def served_tcp(server: ModbusServer, _folder: Path) -> Served:
    port = free_port()
    device = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}'
    return device, lambda stop: server.run_tcp("127.0.0.1", port, stop)


def served_rtu(server: ModbusServer, folder: Path) -> Served:
    device = f'adapter = "modbus-rtu"\nport = "{folder / "rtu"}"'
    return device, lambda stop: server.run_rtu(PtyBridge(folder / "rtu"), stop)


@pytest.mark.parametrize("served", [served_tcp, served_rtu])
@pytest.mark.parametrize("order", ["big", "little"])
def test_every_sample_arrives_once_with_its_codes(
    served: Callable[[ModbusServer, Path], Served], order: str, tmp_path: Path
) -> None:
    device = Device(ToySource(), first_seq=2**32 - 100)
    server = ModbusServer(device, RegisterBank(3, order))
    section, serve = served(server, tmp_path)
    config = config_of(f'{section}\nword_order = "{order}"')
    with in_thread(serve):
        running = Running(config, adapter_for(config.daq.device, config.channels))
        heard = running.more(300)
        running.device.close()
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert numbers[-1] > 2**32
    values = np.concatenate([block.channel("position").values for block in heard.blocks])
    np.testing.assert_array_equal(values, codes_of(np.array(numbers) - 2**32 + 100)[:, 1])
    assert heard.lost() == 0
    assert heard.health.counters["failed_polls"] == 0
