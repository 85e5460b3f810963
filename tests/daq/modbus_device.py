"""A Modbus TCP server of a toy device as a process, so that a test can freeze it: PORT."""

import sys
import threading

from sim_plant.serve.modbus_server import ModbusServer
from sim_plant.serve.register_bank import RegisterBank
from sim_plant.serve.source import Device
from tests.daq.rig import ToySource

if __name__ == "__main__":
    server = ModbusServer(Device(ToySource()), RegisterBank(3))
    server.run_tcp("127.0.0.1", int(sys.argv[1]), threading.Event())
