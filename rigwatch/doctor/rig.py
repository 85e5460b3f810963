"""Checks of one rig's configuration against this machine."""

import glob
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.doctor.finding import Finding, judged
from rigwatch.wire.access import days_left, ending_soon, in_force, key_files, read_register
from rigwatch.wire.errors import KeysError, RigwatchError
from rigwatch.wire.host import endpoint_address, is_free
from rigwatch.wire.rig_config import ModbusRtuSection, RigConfig, SerialSection, load_rig

LOOPBACK = "127.0.0.1"


def check_rig(path: Path) -> Iterator[Finding]:
    """The configuration at `path` and everything that it names."""
    try:
        config = load_rig(path)
    except RigwatchError as error:
        remedy = f"correct {path}; docs/configuration.md lists every key"
        yield Finding("configuration", "fail", str(error), remedy)
        return
    yield Finding("configuration", "ok", f"{path}: rig {config.rig.id}")
    yield from check_files(config)
    yield from check_keys(config)
    yield from check_ports(config)
    yield from check_device(config)


def check_keys(config: RigConfig) -> Iterator[Finding]:
    """The rig's certificates are in force for some time, and private keys are private."""
    if not config.bus.security.keys:
        return
    folder, today = Path(config.bus.security.keys), datetime.now(UTC).date()
    try:
        register = read_register(folder)
    except KeysError as error:
        yield Finding("keys", "fail", str(error), "make them with rigwatch keys new")
        return
    known, soon = in_force(register), ending_soon(register, today)
    ended = any(days_left(one, today) < 0 for one in soon)
    dates = ", ".join(f"{one.name} ends {one.ends}" for one in soon)
    text = dates or f"{folder}: {len(known)} certificates in force"
    remedy = "issue them anew with rigwatch keys issue, and restart the processes"
    yield judged("keys", not soon, text, remedy, "fail" if ended else "warn")
    private = (key_files(folder, one.name)[1] for one in known)
    open_ones = [one.name for one in private if one.is_file() and one.stat().st_mode & 0o077]
    seen = f"others may read {', '.join(open_ones)}" if open_ones else "readable by you only"
    yield judged("private keys", not open_ones, seen, f"chmod 600 {folder}/*.key")


def check_files(config: RigConfig) -> Iterator[Finding]:
    """The files that the configuration names exist."""
    if config.plant is not None:
        scenario = Path(config.plant.scenario)
        yield judged("scenario", scenario.is_file(), f"{scenario}", "correct plant.scenario")
    if config.monitor is not None:
        model = Path(config.monitor.model)
        remedy = "make it with rigwatch commission, or correct monitor.model"
        text = f"{model}" if model.is_file() else f"{model}: no such file"
        yield judged("model", model.is_file(), text, remedy)


def check_ports(config: RigConfig) -> Iterator[Finding]:
    """The ports that the rig's processes will listen on are free."""
    wanted = {"bus.listen": endpoint_address(config.bus.listen)}
    if config.dashboard is not None:
        wanted["dashboard.grpc_port"] = (LOOPBACK, config.dashboard.grpc_port)
        wanted["dashboard.web_port"] = (LOOPBACK, config.dashboard.web_port)
    for key, address in wanted.items():
        if address is not None:
            host, port = address
            remedy = f"stop what uses it (is this rig up already?) or change {key}"
            free = is_free(host, port)
            text = f"port {port} is {'free' if free else 'in use'}"
            yield judged(key, free, text, remedy, "warn")


def check_device(config: RigConfig) -> Iterator[Finding]:
    """The serial line exists and may be used; a simulated rig makes its own."""
    device = config.daq.device
    if isinstance(device, SerialSection | ModbusRtuSection) and config.plant is None:
        yield check_serial(device.port)


def check_serial(pattern: str) -> Finding:
    """The serial line exists, once, and this user may open it."""
    found = sorted(glob.glob(pattern))  # noqa: PTH207 (the pattern is absolute)
    if len(found) != 1:
        seen = ", ".join(found) or "nothing"
        return Finding("device", "fail", f"{pattern} is {seen}", "plug it in, or correct its port")
    port = found[0]
    allowed = os.access(port, os.R_OK | os.W_OK)
    text = port if allowed else f"{port}: no permission to read and write"
    return judged("device", allowed, text, "sudo usermod --append --groups dialout $USER")
