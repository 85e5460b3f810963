"""Another Modbus device in the place of the right one: real servers at one port, daq, monitor."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigwatch.wire.host import free_port
from sim_plant.serve import Device, ModbusServer, RegisterBank
from tests.bus.rig import answers
from tests.faults.field import Field, WaveSource
from tests.waiting import eventually

pytestmark = [pytest.mark.xdist_group("faults-modbus"), pytest.mark.long]
RIGHT, OTHER = "RX-2 no. 4711", "RX-2 no. 4712"


def device() -> Device:
    source = WaveSource()
    source.device = Device(source)
    return source.device


@contextmanager
def served(one: Device, identity: str, port: int) -> Iterator[None]:
    """The device answers at the port, by its identification."""
    server, stop = ModbusServer(one, RegisterBank(3), identity=identity), threading.Event()
    thread = threading.Thread(target=server.run_tcp, args=("127.0.0.1", port, stop), daemon=True)
    thread.start()
    try:
        eventually(lambda: answers(port), f"{identity} listens")
        yield
    finally:
        stop.set()
        thread.join()


def test_the_link_alarm_names_the_other_device_and_none_of_its_samples_is_taken(
    tmp_path: Path,
) -> None:
    port, right, other = free_port(), device(), device()
    section = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {port}\nidentity = "4711"'
    with Field(tmp_path, section) as rig:
        with served(right, RIGHT, port):
            rig.start("daq", "monitor")
            rig.settle(right)
            exchanged = time.time_ns()

        def named() -> bool:
            records = [one for one in rig.journalled("link") if one.active]
            causes = [one.alarm.cause for one in records if one.alarm.t_ns >= exchanged]
            return any("another device" in cause and OTHER in cause for cause in causes)

        with served(other, OTHER, port):
            eventually(named, "the alarm names the other device")
            health = rig.health_after("daq", time.time_ns())
            assert health.state == "reconnecting"
            assert OTHER in health.text
        back = time.time_ns()
        with served(right, RIGHT, port):
            rig.event("running", back)
            rig.cleared("link")
            rig.judged(right.boot, right.next_seq)
        assert {block.boot for block in rig.samples} == {right.boot}
