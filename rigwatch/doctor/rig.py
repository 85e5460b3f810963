"""Checks of one rig's configuration against this machine."""

import glob
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path

from rigwatch.doctor.finding import Finding, judged
from rigwatch.doctor.kept import mended, users_of
from rigwatch.wire.access import days_left, ending_soon, in_force, key_files, read_register
from rigwatch.wire.errors import ConfigError, KeysError
from rigwatch.wire.host import endpoint_address, is_free
from rigwatch.wire.rig_config import (
    ModbusRtuSection,
    ModbusSection,
    PluginSection,
    RigConfig,
    SerialSection,
    load_rig,
)

LOOPBACK = "127.0.0.1"


def check_rig(path: Path, *, fix: bool = False) -> Iterator[Finding]:
    """The configuration at `path` and everything that it names.

    Args:
        path: the configuration.
        fix: mend the files that can be mended, and keep what they were beside them.

    Raises:
        ConfigError: a file cannot be mended, or a process uses one.
    """
    # The code of the processes takes seconds to import, which a check of health does not have.
    from rigwatch.doctor.kept_files import kept_configuration

    kept = kept_configuration(path)
    while fix and kept.mend is not None:
        yield mended(kept)
        kept = kept_configuration(path)
    if kept.level == "fail" and not kept.change:
        remedy = f"correct {path}; docs/configuration.md lists every key"
        yield Finding("configuration", "fail", kept.text, remedy)
        return
    yield kept.finding(path)
    if kept.level == "fail":
        return
    config = load_rig(path)
    yield from check_kept(config, path, fix=fix)
    yield from check_files(config)
    yield from check_thinning(config)
    yield from check_keys(config)
    yield from check_ports(config)
    yield from check_device(config)


def check_kept(config: RigConfig, path: Path, *, fix: bool) -> Iterator[Finding]:
    """The files that the processes keep, mended if `fix`; see `check_rig`."""
    from rigwatch.doctor.kept_files import in_use, kept_files

    for kept in kept_files(config, path):
        if not fix or kept.mend is None:
            yield kept.finding(path)
            continue
        if users := users_of(set(in_use(config))):
            found = f"process {', '.join(map(str, users))} at work on this rig's files"
            raise ConfigError(kept.path, "", found, "the rig's processes to be stopped for --fix")
        yield mended(kept)


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
    remedy = "issue them anew with rigwatch keys issue"
    yield judged("keys", not soon, text, remedy, "fail" if ended else "warn")
    private = (key_files(folder, one.name)[1] for one in known)
    open_ones = [one.name for one in private if one.is_file() and one.stat().st_mode & 0o077]
    seen = f"others may read {', '.join(open_ones)}" if open_ones else "readable by you only"
    yield judged("private keys", not open_ones, seen, f"chmod 600 {folder}/*.key")


def check_files(config: RigConfig) -> Iterator[Finding]:
    """The scenario is one that the simulated device can play."""
    if config.plant is not None:
        from sim_plant.scenario import load_scenario

        try:
            load_scenario(config.plant.scenario)
        except ConfigError as error:
            yield Finding("scenario", "fail", str(error), "correct it, or plant.scenario")
        else:
            yield Finding("scenario", "ok", config.plant.scenario)


def check_thinning(config: RigConfig) -> Iterator[Finding]:
    """What the recorder needs to thin old sessions is installed."""
    recorder = config.recorder
    if recorder is None or not (recorder.thin_days or recorder.thin_alarm_days):
        return
    missing = [name for name in ("pyarrow", "fsspec") if find_spec(name) is None]
    limits = {"thin_days": recorder.thin_days, "thin_alarm_days": recorder.thin_alarm_days}
    ages = ", ".join(f"{name} {days:g}" for name, days in limits.items() if days)
    text = f"{ages}: " + (f"{', '.join(missing)} not installed" if missing else "by the recorder")
    yield judged("thinning", not missing, text, "pip install 'rigwatch[archive]'")


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
    """The serial line exists and may be used, as a simulated rig makes its own; who is told."""
    device = config.daq.device
    yield Finding("identity", "ok", _told_of(config))
    if isinstance(device, SerialSection | ModbusRtuSection) and config.plant is None:
        yield check_serial(device.port)


def _told_of(config: RigConfig) -> str:
    """Whether another device in the place of the right one would be noticed."""
    device = config.daq.device
    if isinstance(device, PluginSection):
        return f"the adapter {device.name} decides whether another device is noticed"
    if not isinstance(device, ModbusSection | ModbusRtuSection):
        return "this device does not tell who it is: another one in its place is not noticed"
    if device.identity:
        return f"only a device that tells {device.identity!r} is read"
    if config.daq.any_device:
        return "any device is read (daq.any_device)"
    if config.monitor is None or not config.monitor.journal:
        return "the first device that tells one is learnt anew at each start: no monitor.journal"
    return "the first device that tells one is learnt, and another one refused"


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
