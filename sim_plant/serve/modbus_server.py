"""The device on Modbus, over TCP or a pty: its ring fills in real time, masters read it."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable
from typing import Any

from pymodbus import FramerType
from pymodbus.constants import ExcCodes
from pymodbus.pdu.device import ModbusDeviceIdentification
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from rigwatch.wire.errors import DeviceError
from rigwatch.wire.host import Heartbeat
from sim_plant.serve.pty_bridge import PtyBridge
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.source import Device, Pace

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)

TracePacket = Callable[[bool, bytes], bytes]
UNIT, BAUD = 1, 115200
"""Unit id; rate of the serial line, which a pty does not need."""
_Server = ModbusTcpServer | ModbusSerialServer


class ModbusServer:
    """Serves the register map of a device until stopped.

    Args:
        device: the device.
        bank: its ring.
        rate: sample rate [Hz].
        trace: called with every packet (sending, bytes), and may change it, for line faults.
        heartbeat: called with the number of samples taken.
        identity: its identification, which a process has one of.

    Attributes:
        exception: exception code in every answer, 0 for none.
    """

    def __init__(
        self,
        device: Device,
        bank: RegisterBank,
        rate: float = 256.0,
        *,
        trace: TracePacket | None = None,
        heartbeat: Heartbeat | None = None,
        identity: str = "",
    ) -> None:
        self.device = device
        self.exception: int = 0
        self._bank = bank
        self._rate = rate
        self._trace = trace
        names = {"VendorName": "rigwatch", "ProductCode": "simulated rig", "ModelName": identity}
        identified: Any = ModbusDeviceIdentification  # pymodbus leaves it untyped
        self._identity = identified(info_name=names) if identity else None
        self._heartbeat = heartbeat or Heartbeat("plant", {})

    def run_tcp(self, host: str, port: int, stop: threading.Event) -> None:
        """Serve on TCP until `stop` is set.

        Raises:
            DeviceError: it cannot listen on the port.
        """
        asyncio.run(self._serve(lambda: self._tcp(host, port), stop, f"{host}:{port}"))

    def run_rtu(self, bridge: PtyBridge, stop: threading.Event) -> None:
        """Serve on a serial line made of a pty until `stop` is set."""
        with bridge:
            asyncio.run(self._serve(lambda: self._rtu(bridge.device_end), stop, "pty"))

    async def _serve(self, make: Callable[[], _Server], stop: threading.Event, where: str) -> None:
        pace = Pace(self._rate)
        self._bank.add(self.device.advance(max(pace.due(), 1)))
        server: Any = make()
        try:
            await server.serve_forever(background=True)
        except (RuntimeError, OSError) as error:
            raise DeviceError(f"{where}: cannot listen here: {error}") from error
        self._heartbeat.ready(f"Modbus at {where}")
        taken = 1
        while not stop.is_set():
            await asyncio.sleep(pace.until_next())
            if n := pace.due():
                self._bank.add(self.device.advance(n))
                taken += n
            self._heartbeat.advance(taken)
        with contextlib.suppress(Exception):
            await server.shutdown()

    def _sim_device(self) -> SimDevice:
        registers = SimData(0, values=[0] * self._bank.size, datatype=DataType.REGISTERS)
        return SimDevice(UNIT, [registers], action=self._fill)

    async def _fill(
        self,
        _function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        _values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if self.exception:
            return ExcCodes(self.exception)
        offset = address - start
        registers[offset : offset + count] = self._bank.read(address, count)
        return None

    def _tcp(self, host: str, port: int) -> ModbusTcpServer:
        return ModbusTcpServer(
            self._sim_device(),
            identity=self._identity,
            address=(host, port),
            trace_packet=self._trace,
        )

    def _rtu(self, port: str) -> ModbusSerialServer:
        return ModbusSerialServer(
            self._sim_device(),
            identity=self._identity,
            framer=FramerType.RTU,
            port=port,
            baudrate=BAUD,
            trace_packet=self._trace,
        )
