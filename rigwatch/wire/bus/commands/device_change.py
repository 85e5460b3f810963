"""Asks data acquisition to take another device for that of the rig, and which one it refuses."""

import msgspec

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.commands.device_request import DeviceReply, DeviceRequest
from rigwatch.wire.errors import BusError
from rigwatch.wire.typed_files import JsonError, json_value

DEVICE_KEY = "daq/device"
DEVICE_RUN_KEY = "daq/receiver"
"""Key at which data acquisition tells the run that a request must name."""
DEVICE_PATIENCE = 10.0
"""Longest time in which it answers, the writing of its file to a slow disk included [s]."""


def ask_for_device(bus: Bus, timeout: float = DEVICE_PATIENCE) -> DeviceReply:
    """Which device is the rig's, and which one is refused.

    Raises:
        BusError: no data acquisition answers that checks its device.
    """
    return _asked(bus, b"", timeout)


def accept_device(
    bus: Bus, request: DeviceRequest, timeout: float = DEVICE_PATIENCE
) -> DeviceReply:
    """Sign and send the request, and wait for the reply.

    Raises:
        BusError: no data acquisition answers that checks its device.
        KeysError: the operator's key cannot be read.
    """
    return _asked(bus, msgspec.json.encode(signed(bus, request, DEVICE_RUN_KEY)), timeout)


def _asked(bus: Bus, question: bytes, timeout: float) -> DeviceReply:
    for reply in bus.query(DEVICE_KEY, question, timeout):
        try:
            return json_value(reply, DeviceReply)
        except JsonError:
            continue
    raise BusError(
        f"no data acquisition of rig {bus.rig} answers that checks which device it has: start "
        "`rigwatch daq`; only devices on Modbus tell who they are"
    )
