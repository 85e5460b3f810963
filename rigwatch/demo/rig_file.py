"""The demonstration's configuration: a rig's file with all that it writes in one folder."""

import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.host import endpoint_address, free_port, is_free
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
from rigwatch.wire.typed_files import find_file

NAME = "rig.toml"
MODEL = "model.toml"
JOURNAL = "alarms.jsonl"
_HOST = "127.0.0.1"


def write_rig_file(source: Path, folder: Path, viewer: str) -> Path:
    """Write the rig's configuration into `folder`; ports that are taken give way to free ones.

    Args:
        source: configuration of a simulated rig on a serial line.
        folder: where the rig's model, journal, recordings and serial line go.
        viewer: how the dashboard is shown.
    """
    config = load_rig(source)
    if config.plant is None:
        raise ConfigError(source, "plant", "no such section", "a simulated rig")
    bus = _free_bus(config.bus)
    own = structs.replace(
        config,
        rig=config.rig if bus is config.bus else _another(config.rig, bus),
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
    # The time makes each run's file another one: the recorder continues with the last session where
    # the configuration is the same.
    head = f"# Made by `rigwatch demo` from {source}, {time.strftime('%Y-%m-%d %H:%M:%S')}.\n"
    target.write_text(head + as_toml(msgspec.to_builtins(own)), encoding="utf-8")
    load_rig(target)
    return target


def forget_alarms(folder: Path) -> None:
    """Begin without the alarms of an earlier run, which a real rig's monitor would restore."""
    for journal in folder.glob(f"{JOURNAL}*"):
        journal.unlink()


def _free_bus(bus: BusSection) -> BusSection:
    address = endpoint_address(bus.listen)
    if address is None or is_free(*address):
        return bus
    endpoint = f"tcp/{_HOST}:{free_port(_HOST)}"
    return structs.replace(bus, router=endpoint, listen=endpoint)


def _another(rig: RigSection, bus: BusSection) -> RigSection:
    """The rig under a name of its own, beside one that is up already."""
    return structs.replace(rig, id=f"{rig.id}-{bus.listen.rpartition(':')[2]}")


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


def as_toml(tree: Mapping[str, Any], prefix: str = "") -> str:
    """A tree of plain values as TOML; None is left out."""
    return "\n".join(_lines(tree, prefix)) + "\n"


def _lines(tree: Mapping[str, Any], prefix: str) -> Iterator[str]:
    tables = {key: value for key, value in tree.items() if _is_table(value)}
    for key, value in tree.items():
        if key not in tables and value is not None:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in tables.items():
        name = f"{prefix}{_key(key)}"
        is_one = isinstance(value, dict)
        for table in [value] if is_one else value:
            yield f"\n[{name}]" if is_one else f"\n[[{name}]]"
            yield from _lines(table, f"{name}.")


def _is_table(value: object) -> bool:
    is_many = isinstance(value, list | tuple) and bool(value) and isinstance(value[0], dict)
    return isinstance(value, dict) or is_many


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() else _value(key)


def _value(value: object) -> str:
    # JSON writes text, numbers, truth and lists of them as TOML does.
    return msgspec.json.encode(value).decode()


def relative(path: Path) -> str:
    """A path as one would type it here."""
    found = os.path.relpath(path)
    return str(path) if found.startswith("..") else found
