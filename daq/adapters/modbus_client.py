"""Input registers through pymodbus, over TCP or a serial line.

pymodbus accepts a reply that is too short and hides a silent device behind retries: here lengths
are checked, nothing is retried and every wait has a timeout.
"""

import contextlib
import logging
import os
from collections.abc import Callable, Iterator
from typing import Any

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException

from daq.adapters.identification import Identification, NoIdentificationError, Objects
from daq.adapters.modbus_poll import ModbusAdapter, RefusedError
from daq.adapters.serial_line import first_that_opens
from rigwatch.wire.errors import DeviceError, ModbusError
from rigwatch.wire.host import ready_to_read, write_within
from rigwatch.wire.rig_config import ChannelSection, ModbusRtuSection, ModbusSection

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)

_CODES = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    5: "acknowledged, not ready yet",
    6: "busy",
    10: "gateway path unavailable",
    11: "gateway: the unit does not answer",
}
_REPEATABLE = (5, 6)
_NONE_THERE = (1, 2, 3)
"""Exception codes of a device that has no identification; after others it may be asked again."""
_CHUNK = 4096
_ALL_OBJECTS, _MOST_ANSWERS = 3, 8
"""Read code for basic, regular and extended objects; answers over which they may be divided."""


class PymodbusRegisters:
    """Input registers of one unit.

    Args:
        make: makes and opens a client; raises `DeviceError` if that fails.
        unit: unit id.
        where: names the device in errors.
    """

    def __init__(self, make: Callable[[], Any], unit: int, where: str) -> None:
        self._make = make
        self._unit = unit
        self._where = where
        self._client: Any = None

    def open(self) -> None:
        """Connect.

        Raises:
            DeviceError: no answer at that address.
        """
        self.close()
        self._client = self._make()

    def read(self, address: int, count: int) -> list[int]:
        """`count` registers from `address`.

        Raises:
            RefusedError: exception codes that point to a wrong configuration.
            ModbusError: no answer in time, a short answer, or exception codes 5 and 6.
            DeviceError: the connection is gone.
        """
        if self._client is None:
            raise DeviceError(f"{self._where}: not connected")
        try:
            reply = self._client.read_input_registers(address, count=count, device_id=self._unit)
        except ConnectionException as error:
            raise DeviceError(f"{self._where}: the connection was closed") from error
        except ModbusException as error:
            raise ModbusError(f"{self._where}: no valid answer in time") from error
        except (OSError, serial.SerialException) as error:
            raise DeviceError(f"{self._where}: {error}") from error
        except Exception as error:
            # Replies cut short or garbled make pymodbus's decoders raise arbitrary exceptions.
            raise ModbusError(f"{self._where}: an answer that cannot be decoded") from error
        self._check(reply, count)
        return list(reply.registers)

    def identification(self) -> Objects:
        """The texts by which the device identifies itself (function 43/14), by their number.

        Raises:
            NoIdentificationError: the device answers that it has none.
            ModbusError: no valid answer.
        """
        found: dict[int, str] = {}
        first = 0
        for _ in range(_MOST_ANSWERS):
            try:
                reply = self._client.read_device_information(
                    read_code=_ALL_OBJECTS, object_id=first, device_id=self._unit
                )
            except Exception as error:
                raise ModbusError(f"{self._where}: no identification in time") from error
            if reply.isError():
                raise self._unidentified(int(getattr(reply, "exception_code", 0)))
            found |= {number: _as_text(text) for number, text in reply.information.items()}
            if not reply.more_follows or reply.next_object_id <= first:
                break
            first = reply.next_object_id
        return found

    def _unidentified(self, code: int) -> ModbusError:
        """The error for an exception code in place of an identification."""
        if code in _NONE_THERE:
            text = "the device has no identification (43/14)"
            return NoIdentificationError(f"{self._where}: {text}")
        return ModbusError(f"{self._where}: no identification, {_CODES.get(code, 'unknown')}")

    def close(self) -> None:
        """Close the connection."""
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.close()
            self._client = None

    def _check(self, reply: Any, count: int) -> None:
        if reply.isError():
            code = int(getattr(reply, "exception_code", 0))
            kind = ModbusError if code in _REPEATABLE else RefusedError
            raise kind(f"{self._where}: exception code {code}, {_CODES.get(code, 'unknown')}")
        if len(reply.registers) != count:
            found = f"a reply of {len(reply.registers)} registers"
            raise ModbusError(f"{self._where}: {found}, expected {count}")


def _as_text(value: bytes | list[bytes]) -> str:
    parts = value if isinstance(value, list) else [value]
    return " ".join(part.decode("utf-8", "replace") for part in parts).strip()


class _TcpClient(ModbusTcpClient):
    """A client whose connection may have any descriptor."""

    def recv(self, size: int | None) -> bytes:
        """The bytes available now or before the timeout; empty if there are none."""
        if self.socket is None:
            raise ConnectionException(str(self))
        if not ready_to_read((self.socket.fileno(),), self.comm_params.timeout_connect or 0.0):
            return b""
        data: bytes = self.socket.recv(size or _CHUNK)
        if not data:
            self.close()  # type: ignore[no-untyped-call]
            raise ConnectionException(str(self))
        return data


class _RtuClient(ModbusSerialClient):
    """A serial client that waits for bytes instead of polling every millisecond.

    pyserial waits for each write, which no descriptor above 1023 survives, and for ever.
    """

    def open_port(self) -> None:
        """Open the port exclusively; errors are the operating system's."""
        params = self.comm_params
        self.socket = serial.Serial(
            params.host, params.baudrate, timeout=params.timeout_connect, exclusive=True
        )

    def send(self, request: bytes, addr: object = None) -> int:  # noqa: ARG002 (of the base)
        """Send a request; drops what has come of an earlier one."""
        descriptor = self._descriptor()
        with self._closed_if_lost():
            if ready_to_read((descriptor,), 0.0) and not os.read(descriptor, _CHUNK):
                raise EOFError
            return write_within(descriptor, request, self._timeout)

    def recv(self, size: int | None) -> bytes:
        """The bytes available now or before the timeout; empty if there are none."""
        descriptor = self._descriptor()
        with self._closed_if_lost():
            if not ready_to_read((descriptor,), self._timeout):
                return b""
            if data := os.read(descriptor, size or _CHUNK):
                return data
            raise EOFError

    @property
    def _timeout(self) -> float:
        return self.comm_params.timeout_connect or 0.0

    def _descriptor(self) -> int:
        if self.socket is None:
            raise ConnectionException(str(self))
        return int(self.socket.fileno())

    @contextlib.contextmanager
    def _closed_if_lost(self) -> Iterator[None]:
        try:
            yield
        except (OSError, EOFError):
            self.close()  # type: ignore[no-untyped-call]
            raise ConnectionException(str(self)) from None


def tcp(section: ModbusSection, channels: tuple[ChannelSection, ...]) -> ModbusAdapter:
    """Entry point `modbus-tcp` of the group `rigwatch.adapters`."""
    where = f"{section.host}:{section.port}"

    def make() -> Any:
        client: Any = _TcpClient(
            section.host, port=section.port, timeout=section.timeout, retries=0
        )
        if not client.connect():
            raise DeviceError(f"{where}: no answer")
        return client

    return _adapter(PymodbusRegisters(make, section.unit, where), section, len(channels), where)


def rtu(section: ModbusRtuSection, channels: tuple[ChannelSection, ...]) -> ModbusAdapter:
    """Entry point `modbus-rtu` of the group `rigwatch.adapters`."""

    def opened(path: str) -> "_RtuClient":
        client = _RtuClient(
            path, framer=FramerType.RTU, baudrate=section.baud, timeout=section.timeout, retries=0
        )
        client.open_port()
        return client

    registers = PymodbusRegisters(
        lambda: first_that_opens(section.port, opened), section.unit, section.port
    )
    return _adapter(registers, section, len(channels), section.port)


def _adapter(
    registers: PymodbusRegisters,
    section: ModbusSection | ModbusRtuSection,
    channels: int,
    where: str,
) -> ModbusAdapter:
    who = Identification(registers.identification, section.identity, where)
    return ModbusAdapter(registers, channels, section.polls, section.word_order, who=who)
