"""From the device's codes over a real pty to calibrated samples, in real time."""

from pathlib import Path

import numpy as np

from daq.adapters.serial_line import SerialAdapter, SerialPort
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.daq.rig import Running, ToySource, codes_of, config_of, in_thread


def test_every_sample_arrives_once_with_its_codes(tmp_path: Path) -> None:
    port = str(tmp_path / "rig")
    device = Device(ToySource())
    server = SerialServer(device, PtyLine(port))
    config = config_of(f'adapter = "serial"\nport = "{port}"')
    with in_thread(server.run):
        running = Running(config, SerialAdapter(SerialPort(port, 115200), 3))
        heard = running.more(100)
        running.device.close()
    numbers = [seq for _, seq in heard.numbers()]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert {boot for boot, _ in heard.numbers()} == {device.boot}
    values = np.concatenate([block.channel("position").values for block in heard.blocks])
    np.testing.assert_array_equal(values, codes_of(numbers)[:, 1])
    assert (heard.lost(), heard.health.counters["crc_errors"]) == (0, 0)
    assert heard.health.state == "running"


def test_time_stamps_keep_the_pace_of_the_device(tmp_path: Path) -> None:
    port = str(tmp_path / "rig")
    server = SerialServer(Device(ToySource()), PtyLine(port))
    config = config_of(f'adapter = "serial"\nport = "{port}"')
    with in_thread(server.run):
        running = Running(config, SerialAdapter(SerialPort(port, 115200), 3))
        heard = running.more(100)
        running.device.close()
    stamps = np.concatenate([block.t_ns for block in heard.blocks])
    steps = np.diff(stamps)
    assert (steps > 0).all()
    assert abs(np.median(steps) - 1e9 / 256) < 1e4
