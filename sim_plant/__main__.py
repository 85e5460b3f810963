"""The simulated device as a process: scenario ─▶ samples in real time ─▶ serial line or Modbus.

Started by `rigwatch plant CONFIG` or `python -m sim_plant CONFIG`.
"""

import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.wire.errors import ConfigError, RigwatchError
from rigwatch.wire.host import Heartbeat, set_at_signal, unless_ended
from rigwatch.wire.rig_config import PlantSection, RigConfig, load_rig, section_or_error
from sim_plant.effects import CHANNELS, EFFECTS
from sim_plant.scenario import ScenarioRun, load_scenario
from sim_plant.serve import (
    Commands,
    Controlled,
    ControlServer,
    Device,
    LineFaults,
    PtyBridge,
    PtyLine,
    SerialServer,
    control_path,
)

if TYPE_CHECKING:
    from sim_plant.serve import ModbusServer


def serve(config: RigConfig, plant: PlantSection, stop: threading.Event) -> None:
    """Serve the scenario of `plant` in real time until `stop` is set.

    Raises:
        ConfigError: the scenario is wrong, or does not suit the rig.
        DeviceError: the line or port cannot be created, or this rig is already simulated.
    """
    scenario = load_scenario(plant.scenario)
    rate = scenario.plant.sample_rate
    if rate != config.rig.sample_rate:
        expected = f"{config.rig.sample_rate} Hz as in rig.sample_rate"
        raise ConfigError(plant.scenario, "plant.sample_rate", f"{rate} Hz", expected)
    run = unless_ended(stop, lambda: ScenarioRun(scenario, plant.seed))
    controlled = Controlled(run, run.rig)
    device, faults = Device(controlled), LineFaults(plant.seed)
    neutral = {name: effect.neutral for name, effect in EFFECTS.items()}
    commands = Commands(controlled, device, faults if plant.serve == "serial" else None, neutral)
    with ControlServer(control_path(config.rig.id), commands.answer):
        _SERVERS[plant.serve](plant, device, rate, faults, stop)


def _serial(
    plant: PlantSection, device: Device, rate: float, faults: LineFaults, stop: threading.Event
) -> None:
    SerialServer(device, PtyLine(plant.port), rate, faults, Heartbeat("plant")).run(stop)


def _modbus_tcp(
    plant: PlantSection, device: Device, rate: float, _faults: LineFaults, stop: threading.Event
) -> None:
    host, _, port = plant.port.rpartition(":")
    if not host or not port.isdigit():
        raise ConfigError("[plant]", "port", repr(plant.port), "host:port for Modbus TCP")
    _modbus(device, rate).run_tcp(host, int(port), stop)


def _modbus_rtu(
    plant: PlantSection, device: Device, rate: float, _faults: LineFaults, stop: threading.Event
) -> None:
    _modbus(device, rate).run_rtu(PtyBridge(plant.port), stop=stop)


def _modbus(device: Device, rate: float) -> "ModbusServer":
    # pymodbus takes a third of a second to import; the serial line does not need it.
    from sim_plant.serve import ModbusServer, RegisterBank

    return ModbusServer(device, RegisterBank(len(CHANNELS)), rate, heartbeat=Heartbeat("plant"))


_SERVERS = {"serial": _serial, "modbus-tcp": _modbus_tcp, "modbus-rtu": _modbus_rtu}


def main(path: Path | str) -> int:
    """Serve the rig configured at `path` until a signal ends it; the exit code."""
    config = load_rig(path)
    section_or_error(config, "plant", path)
    stop = set_at_signal()
    if config.plant is not None:
        serve(config, config.plant, stop)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1]))
    except RigwatchError as error:
        sys.exit(f"sim_plant: {error}")
