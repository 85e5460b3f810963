"""Checks the health of a running process over the bus: what a container's health check runs."""

import socket
import time
from pathlib import Path

from rigwatch.doctor.finding import Finding, judged
from rigwatch.wire.bus import Bus, connect, unique_process
from rigwatch.wire.errors import BusError
from rigwatch.wire.host import endpoint_address
from rigwatch.wire.messages import ALIVE_KEY, HEALTH, MONITOR_STALE, Health
from rigwatch.wire.rig_config import PlantSection, RigConfig

ROUTER_TIMEOUT = 3.0
WORD_TIMEOUT = 3.0
"""Longest wait for a process's health, which it publishes every second [s]."""
WELL = ("running", "recording", MONITOR_STALE)
"""The states of a healthy process; a witness that finds the monitor stale does its work."""


def check_alive(config: RigConfig, process: str) -> Finding:
    """Whether `process` of the rig runs and reports that it is healthy."""
    if process == "plant":
        return _check_plant(config.plant)
    try:
        bus = connect(config, unique_process("doctor"), ROUTER_TIMEOUT)
    except BusError as error:
        return Finding("router", "fail", str(error), "start it with rigwatch router")
    try:
        if process == "router":
            return Finding("router", "ok", f"answers at {config.bus.router}")
        return _check_on_bus(bus, process)
    finally:
        bus.close()


def _check_on_bus(bus: Bus, process: str) -> Finding:
    words = bus.subscribe(HEALTH)
    if f"{ALIVE_KEY}/{process}" not in bus.tokens(f"{ALIVE_KEY}/*"):
        return Finding(process, "fail", "is not on the bus", f"start rigwatch {process}")
    deadline = time.monotonic() + WORD_TIMEOUT
    while (left := deadline - time.monotonic()) > 0:
        health: Health | None = words.get(timeout=left)
        if health is not None and health.source.partition("/")[0] == process:
            text = f"{health.state} {health.text}".strip()
            return judged(process, health.state in WELL, text, "look at its output")
    text = f"has said nothing for {WORD_TIMEOUT:g} s"
    return Finding(process, "fail", text, "look at its output; start it again")


def _check_plant(plant: PlantSection | None) -> Finding:
    """Whether the line of the simulated device, which is not on the bus, exists."""
    if plant is None:
        return Finding("plant", "fail", "no section [plant]", "leave it out")
    if plant.serve != "modbus-tcp":
        return judged("plant", Path(plant.port).exists(), plant.port, "start rigwatch plant")
    address = endpoint_address(f"tcp/{plant.port}")
    with socket.socket() as probe:
        probe.settimeout(1.0)
        answers = address is not None and probe.connect_ex(address) == 0
    return judged("plant", answers, f"Modbus at {plant.port}", "start rigwatch plant")
