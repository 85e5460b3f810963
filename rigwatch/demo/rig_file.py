"""The demonstration's configuration: a rig's file with all output in one folder."""

import os
import time
from itertools import chain, count
from pathlib import Path

import msgspec
from msgspec import structs

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.host import endpoint_address, free_port, is_free
from rigwatch.wire.new_file import write_new
from rigwatch.wire.rig_config import (
    BusSection,
    DaqSection,
    DashboardSection,
    MonitorSection,
    PlantSection,
    RecorderSection,
    RigSection,
    SerialSection,
    load_rig,
)
from rigwatch.wire.typed_files import as_toml, find_file
from sim_plant.serve import control_path, holder

NAME = "rig.toml"
MODEL = "model.toml"
JOURNAL = "alarms.jsonl"
_HOST = "127.0.0.1"


def write_rig_file(source: Path, folder: Path, viewer: str) -> Path:
    """Write the rig's configuration into `folder`, with a free name and ports for used ones.

    Args:
        source: configuration of a simulated rig on a serial line.
        folder: for the rig's model, journal, recordings and serial line.
        viewer: kind of viewer for the dashboard.
    """
    config = load_rig(source)
    if config.plant is None:
        raise ConfigError(source, "plant", "no such section", "a simulated rig")
    bus = _free_bus(config.bus)
    own = structs.replace(
        config,
        base="",
        rig=_free_rig(config.rig, bus, alone=bus is config.bus),
        bus=bus,
        daq=_serial(config.daq, folder),
        plant=_plant(config.plant, folder),
        monitor=_monitor(config.monitor, folder),
        recorder=structs.replace(
            config.recorder or RecorderSection(), folder=str(folder / "sessions")
        ),
        dashboard=_free_dashboard(config.dashboard or DashboardSection(), viewer),
    )
    target = folder / NAME
    # The time makes each run's file unique: the recorder continues the last session if
    # the configuration is unchanged.
    head = f"# Made by `rigwatch demo` from {source}, {time.strftime('%Y-%m-%d %H:%M:%S')}.\n"
    write_new(target, head + as_toml(msgspec.to_builtins(own)), replace=True)
    load_rig(target)
    return target


def forget_alarms(folder: Path) -> None:
    """Start without the alarms of an earlier run, which a real rig's monitor restores."""
    for journal in folder.glob(f"{JOURNAL}*"):
        journal.unlink()


def _free_bus(bus: BusSection) -> BusSection:
    address = endpoint_address(bus.listen)
    if address is None or is_free(*address):
        return bus
    endpoint = f"tcp/{_HOST}:{free_port(_HOST)}"
    return structs.replace(bus, router=endpoint, listen=endpoint)


def _free_rig(rig: RigSection, bus: BusSection, *, alone: bool) -> RigSection:
    """The rig, under a unique name beside one that is already running or being started."""
    other = f"{rig.id}-{bus.listen.rpartition(':')[2]}"
    names = chain([rig.id] if alone else [], [other], (f"{other}-{number}" for number in count(2)))
    return structs.replace(rig, id=next(name for name in names if not holder(control_path(name))))


def _line(folder: Path) -> str:
    return str(folder / "serial-line")


def _serial(daq: DaqSection, folder: Path) -> DaqSection:
    return structs.replace(daq, device=SerialSection(port=_line(folder)))


def _plant(plant: PlantSection, folder: Path) -> PlantSection:
    scenario = find_file(plant.scenario, "scenarios")
    return structs.replace(plant, serve="serial", port=_line(folder), scenario=str(scenario))


def _monitor(monitor: MonitorSection | None, folder: Path) -> MonitorSection:
    model, journal = str(folder / MODEL), str(folder / JOURNAL)
    if monitor is None:
        return MonitorSection(model=model, journal=journal)
    return structs.replace(monitor, model=model, journal=journal)


def _free_dashboard(dashboard: DashboardSection, viewer: str) -> DashboardSection:
    ports = {
        name: port if is_free(_HOST, port) else free_port(_HOST)
        for name in ("grpc_port", "web_port")
        for port in [getattr(dashboard, name)]
    }
    return structs.replace(dashboard, viewer=viewer, **ports)


def relative(path: Path) -> str:
    """A path relative to the working folder, if it is below it."""
    found = os.path.relpath(path)
    return str(path) if found.startswith("..") else found
