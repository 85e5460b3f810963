"""The interfaces of the simulated device: serial frames on a pty, Modbus over TCP or a pty."""

from sim_plant.serve.commands import Commands, Controlled
from sim_plant.serve.control import ControlServer, ask, control_path, holder
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.pty_bridge import PtyBridge
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device

__all__ = [
    "Commands",
    "ControlServer",
    "Controlled",
    "Device",
    "LineFaults",
    "ModbusServer",
    "PtyBridge",
    "PtyLine",
    "RegisterBank",
    "SerialServer",
    "ask",
    "control_path",
    "holder",
]
