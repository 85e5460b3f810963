"""The simulated device as a process: scenario ─▶ samples in real time ─▶ serial line or Modbus.

python -m sim_plant CONFIG
"""

import signal
import sys
import threading
from pathlib import Path

from rigwatch.wire.errors import ConfigError, RigwatchError
from rigwatch.wire.heartbeat import Heartbeat
from rigwatch.wire.rig_config import PlantSection, RigConfig, load_rig, section_or_error
from sim_plant.effects import EFFECTS
from sim_plant.scenario import ScenarioRun, load_scenario
from sim_plant.serve.commands import Commands, Controlled
from sim_plant.serve.control import ControlServer, control_path
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device


def serve(config: RigConfig, plant: PlantSection, stop: threading.Event) -> None:
    """Serve the scenario of `plant` in real time until `stop` is set.

    Raises:
        ConfigError: the scenario is wrong, or does not suit the rig.
        DeviceError: the line or port cannot be made, or this rig is simulated already.
    """
    scenario = load_scenario(plant.scenario)
    rate = scenario.plant.sample_rate
    if rate != config.rig.sample_rate:
        expected = f"{config.rig.sample_rate} Hz as in rig.sample_rate"
        raise ConfigError(plant.scenario, "plant.sample_rate", f"{rate} Hz", expected)
    run = ScenarioRun(scenario, plant.seed)
    controlled = Controlled(run, run.rig)
    device, faults = Device(controlled), LineFaults(plant.seed)
    neutral = {name: effect.neutral for name, effect in EFFECTS.items()}
    has_line = plant.serve == "serial"
    commands = Commands(controlled, device, faults if has_line else None, neutral)
    heartbeat = _Beat(stop)
    with ControlServer(control_path(config.rig.id), commands.answer):
        if plant.serve == "serial":
            line = PtyLine(plant.port)
            SerialServer(device, line, rate, faults, heartbeat.advance).run(stop)
        else:
            _serve_modbus(plant, device, rate, stop, heartbeat)
