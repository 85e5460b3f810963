"""The configuration of a rig: one TOML file read by all its processes.

Each process has its section. `load_rig` reads the file; `configs/demo.toml` is an example with all
sections. The descriptions of the keys are the source of `docs/configuration.md`.
"""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, field

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section, holder, load_layered, whole_text

Text = Annotated[str, Meta(min_length=1)]
SLOWEST, FASTEST = 1e-3, 1e6
"""Sample rates that a rig may have [Hz]."""


class RigSection(Section, frozen=True):
    """[rig] — the monitored rig."""

    id: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_-]+$", description="the rig's name on the bus")]
    sample_rate: Annotated[
        float, Meta(ge=SLOWEST, le=FASTEST, description="nominal sample rate [Hz]")
    ] = 256.0


class SecuritySection(Section, frozen=True):
    """[bus.security] — access to the bus."""

    keys: Annotated[
        str,
        Meta(description="folder with the rig's certificates, empty for none (loopback only)"),
    ] = ""
    operator: Annotated[
        Text, Meta(description="name of the certificate used by commands on this machine")
    ] = "operator"
    secret: Annotated[
        str,
        Meta(
            description="without keys: file of the secret that commands are signed with, empty for "
            "`commands.secret` in the account's state folder"
        ),
    ] = ""
    isolated_network: Annotated[
        bool,
        Meta(
            description="the router may listen beyond loopback without keys: its network is closed "
            "to others, such as one of containers"
        ),
    ] = False


class BusSection(Section, frozen=True):
    """[bus] — endpoints of the Zenoh router."""

    router: Annotated[Text, Meta(description="endpoint that processes connect to")] = (
        "tcp/127.0.0.1:7447"
    )
    listen: Annotated[Text, Meta(description="endpoint on which `rigwatch router` listens")] = (
        "tcp/127.0.0.1:7447"
    )
    links: Annotated[
        tuple[Text, ...],
        Meta(
            description="endpoints of other sites' routers that `rigwatch router` links to; beyond "
            "loopback only with keys"
        ),
    ] = ()
    lease: Annotated[
        float, Meta(gt=0, description="silence after which a link counts as broken [s]")
    ] = 10.0
    ring_megabytes: Annotated[
        float,
        Meta(
            gt=0,
            description="memory of each numbered topic for messages that readers may have missed "
            "[MB]; of alarms and model changes at most 2",
        ),
    ] = 32.0
    security: Annotated[SecuritySection, Meta(description="access to the bus")] = field(
        default_factory=SecuritySection
    )


class ChannelSection(Section, frozen=True):
    """[[channels]] — one channel of the device, in the order of its codes."""

    name: Annotated[Text, Meta(description="the channel's name, such as voltage")]
    unit: Annotated[Text, Meta(description="SI unit of the calibrated value")]
    gain: Annotated[float, Meta(description="SI units per code")]
    offset: Annotated[float, Meta(description="SI value at code 0")] = 0.0
    code_low: Annotated[int, Meta(description="lower rail of the converter")] = -32768
    code_high: Annotated[int, Meta(description="upper rail of the converter")] = 32767
    low: Annotated[float | None, Meta(description="lower end of the sensor's range [SI]")] = None
    high: Annotated[float | None, Meta(description="upper end of the sensor's range [SI]")] = None
    stuck_after: Annotated[
        int, Meta(ge=0, description="equal codes that mean a stuck sensor, 0 for never")
    ] = 100
    spike_above: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(description="largest change within one sample [SI]"),
    ] = None


class SerialSection(Section, frozen=True, tag="serial", tag_field="adapter"):
    """[daq.device] adapter = "serial" — COBS frames on a serial line."""

    port: Annotated[Text, Meta(description="device file or glob pattern, such as by-id links")]
    baud: Annotated[int, Meta(gt=0, description="baud rate")] = 115200


UnitId = Annotated[int, Meta(ge=0, le=247, description="unit id")]
Polls = Annotated[float, Meta(gt=0, description="polls a second")]
WordOrder = Annotated[
    Literal["big", "little"],
    Meta(description="word order of 32-bit values: big puts the high word first"),
]
ReplyTime = Annotated[float, Meta(gt=0, description="time a reply may take [s]")]


Identification = Annotated[
    str,
    Meta(
        description="text, such as a serial number, that the device must have in its "
        "identification (function 43/14); of another device no sample is taken; empty for what "
        "the first device told"
    ),
]


class ModbusSection(Section, frozen=True, tag="modbus-tcp", tag_field="adapter"):
    """[daq.device] adapter = "modbus-tcp" — blocks of buffered samples polled over TCP."""

    host: Annotated[Text, Meta(description="host name or address")]
    port: Annotated[int, Meta(ge=1, le=65535, description="TCP port")] = 502
    unit: UnitId = 1
    polls: Polls = 32.0
    word_order: WordOrder = "big"
    timeout: ReplyTime = 0.3
    identity: Identification = ""


class ModbusRtuSection(Section, frozen=True, tag="modbus-rtu", tag_field="adapter"):
    """[daq.device] adapter = "modbus-rtu" — the same registers over a serial line."""

    port: Annotated[Text, Meta(description="device file or glob pattern")]
    baud: Annotated[int, Meta(gt=0, description="baud rate")] = 115200
    unit: UnitId = 1
    polls: Polls = 32.0
    word_order: WordOrder = "big"
    timeout: ReplyTime = 0.3
    identity: Identification = ""


class ReplaySection(Section, frozen=True, tag="replay", tag_field="adapter"):
    """[daq.device] adapter = "replay" — a recorded session instead of a device."""

    session: Annotated[Text, Meta(description="session file or folder")]
    speed: Annotated[float, Meta(gt=0, description="times real time")] = 1.0
    loop: Annotated[bool, Meta(description="start again at the end")] = False


class PluginSection(Section, frozen=True, tag="plugin", tag_field="adapter"):
    """[daq.device] adapter = "plugin" — an adapter found through the entry points."""

    name: Annotated[Text, Meta(description="name in the entry point group rigwatch.adapters")]
    options: Annotated[dict[str, str | int | float | bool], Meta(description="for the adapter")] = (
        field(default_factory=dict)
    )


DeviceSection = SerialSection | ModbusSection | ModbusRtuSection | ReplaySection | PluginSection


class DaqSection(Section, frozen=True):
    """[daq] — the device and how its samples are published."""

    device: Annotated[DeviceSection, Meta(description="the adapter and its settings")]
    name: Annotated[Text, Meta(description="the device's name in messages")] = "rig"
    any_device: Annotated[
        bool,
        Meta(
            description="samples are also taken of another device than the one that was met first; "
            "otherwise it has to be accepted with `rigwatch accept`"
        ),
    ] = False
    ring: Annotated[
        int, Meta(ge=256, description="samples stored for readers that missed some")
    ] = 65536
    stale_after: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(
            description="time without samples that raises `stale` [s], at least two periods or "
            "polls; by default three of them, and no less than 0.1"
        ),
    ] = None


class PlantSection(Section, frozen=True):
    """[plant] — the simulated rig, used instead of a device."""

    scenario: Annotated[Text, Meta(description="scenario file")]
    serve: Annotated[
        Literal["serial", "modbus-tcp", "modbus-rtu"], Meta(description="how it is read")
    ] = "serial"
    port: Annotated[str, Meta(description="link made to the pty, or host:port for TCP")] = (
        "/tmp/rigwatch-plant"
    )
    seed: Annotated[int, Meta(ge=0, description="seed of noise and multisines")] = 1


class AlarmSection(Section, frozen=True):
    """[monitor.alarms.<name>] — how a condition becomes an alarm; defaults are the alarm's own."""

    persistence: Annotated[
        Annotated[int, Meta(ge=1)] | None, Meta(description="samples the condition must hold")
    ] = None
    clear_after: Annotated[
        Annotated[int, Meta(ge=1)] | None, Meta(description="samples without it before it clears")
    ] = None
    latch: Annotated[bool | None, Meta(description="stays until reset by an operator")] = None
    enabled: Annotated[bool, Meta(description="whether it is raised at all")] = True


class MonitorSection(Section, frozen=True):
    """[monitor] — the model, detectors and alarms."""

    model: Annotated[Text, Meta(description="model file made by `rigwatch commission`")]
    detectors: Annotated[
        tuple[Literal["friction", "parity-arma", "parity-ma", "unknown-input-kalman"], ...],
        Meta(description="which detectors run"),
    ] = ("friction",)
    journal: Annotated[
        str, Meta(description="alarm journal that survives restarts, empty for none")
    ] = ""
    alarms: Annotated[dict[str, AlarmSection], Meta(description="settings by alarm")] = field(
        default_factory=dict
    )
    effect_files: Annotated[
        tuple[str, ...], Meta(description="own effects considered as probable causes of an alarm")
    ] = ()


class RecorderSection(Section, frozen=True):
    """[recorder] — recording of sessions."""

    folder: Annotated[Text, Meta(description="folder of the sessions")] = "sessions"
    segment: Annotated[float, Meta(gt=0, description="length of a segment [s]")] = 3600.0
    session_days: Annotated[
        float,
        Meta(
            ge=0,
            description="length of a session, after which the next one begins without a missing "
            "sample [days]; 0 for one session until the recorder stops",
        ),
    ] = 0.0
    flush: Annotated[
        Annotated[float, Meta(gt=0, le=0.9)] | None,
        Meta(
            description="longest time until what was received is on the disk [s]; 0.5 if it is not"
            " given, 0.9 in a process that records 32 rigs or more"
        ),
    ] = None
    remote: Annotated[
        bool,
        Meta(
            description="records a rig of another site over linked routers; what it missed it "
            "fetches from the rings and then from the recordings of that site"
        ),
    ] = False
    keep_days: Annotated[
        float, Meta(ge=0, description="age at which segments are removed [days]; 0 for never")
    ] = 0.0
    keep_alarm_days: Annotated[
        float, Meta(ge=0, description="the same for segments with alarms [days]; 0 for never")
    ] = 0.0
    keep_gigabytes: Annotated[
        float,
        Meta(
            ge=0,
            description="total size of the rig's segments above which the oldest are removed, "
            "those with alarms last [GB]; 0 for no limit",
        ),
    ] = 0.0
    thin_days: Annotated[
        float,
        Meta(
            ge=0,
            description="age at which sessions are thinned in the background: least, mean and "
            "largest value of each second stay; needs `session_days` and `rigwatch[archive]` "
            "[days]; 0 for never",
        ),
    ] = 0.0
    thin_alarm_days: Annotated[
        float, Meta(ge=0, description="the same for sessions with alarms [days]; 0 for never")
    ] = 0.0


class WitnessSection(Section, frozen=True):
    """[witness] — a separate process that supervises the monitor and sends notifications."""

    stale_after: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        Meta(
            description="time without estimates that raises `monitor_stale` [s], at least two "
            "periods or polls of the device; by default three of them, and no less than 1"
        ),
    ] = None
    heartbeat_file: Annotated[
        str,
        Meta(description="file renewed every second while estimates come, empty for none"),
    ] = ""
    heartbeat_url: Annotated[
        str,
        Meta(description="http(s) address requested while estimates come, empty for none"),
    ] = ""
    heartbeat_seconds: Annotated[
        float, Meta(gt=0, description="interval of these requests [s]")
    ] = 30.0
    metrics: Annotated[
        str,
        Meta(
            description="host:port of a Prometheus endpoint, such as 127.0.0.1:9464, empty for "
            "none; needs `rigwatch[notify]`, beyond loopback also keys"
        ),
    ] = ""
    people: Annotated[
        str,
        Meta(description="file with recipients of notifications and maintenance windows"),
    ] = ""
    notify: Annotated[
        tuple[str, ...],
        Meta(
            description="command run for each alarm, with name, severity and cause as arguments "
            "and all of it as JSON on standard input; empty for none"
        ),
    ] = ()
    notify_from: Annotated[
        Literal["info", "warning", "error", "critical"],
        Meta(description="lowest severity that is notified"),
    ] = "error"
    repeat_minutes: Annotated[
        float,
        Meta(
            ge=0, description="interval of repeats for an unacknowledged alarm [min]; 0 for never"
        ),
    ] = 0.0


class DashboardSection(Section, frozen=True):
    """[dashboard] — the live view."""

    viewer: Annotated[
        Literal["auto", "native", "web", "connect"], Meta(description="which viewer is used")
    ] = "auto"
    grpc_port: Annotated[int, Meta(ge=1, le=65535, description="port of the viewer's data")] = 9876
    web_port: Annotated[int, Meta(ge=1, le=65535, description="port of the web viewer")] = 9090
    update_rate: Annotated[float, Meta(gt=0, le=30, description="updates a second [Hz]")] = 6.0


class RigConfig(Section, frozen=True):
    """The configuration file."""

    rig: Annotated[RigSection, Meta(description="what is watched")]
    channels: Annotated[tuple[ChannelSection, ...], Meta(min_length=1, description="channels")]
    daq: Annotated[DaqSection, Meta(description="data acquisition")]
    base: Annotated[
        str,
        Meta(
            description="file with common settings, relative to this file, which takes "
            "precedence key by key, channels by name"
        ),
    ] = ""
    bus: Annotated[BusSection, Meta(description="the bus")] = field(default_factory=BusSection)
    plant: Annotated[PlantSection | None, Meta(description="the simulated rig")] = None
    monitor: Annotated[MonitorSection | None, Meta(description="the monitor")] = None
    recorder: Annotated[RecorderSection | None, Meta(description="the recorder")] = None
    witness: Annotated[WitnessSection | None, Meta(description="the witness")] = None
    dashboard: Annotated[DashboardSection | None, Meta(description="the dashboard")] = None

    @property
    def interval(self) -> float:
        """Time from one arrival of samples to the next, with a healthy device [s]."""
        device = self.daq.device
        speed = device.speed if isinstance(device, ReplaySection) else 1.0
        period = 1.0 / (self.rig.sample_rate * speed)
        if isinstance(device, ModbusSection | ModbusRtuSection):
            return max(period, 1.0 / device.polls)
        return period

    @property
    def stale_after(self) -> float:
        """Silence after which the device counts as stale [s]."""
        return self.daq.stale_after or max(0.1, 3.0 * self.interval)

    @property
    def unwatched_after(self) -> float:
        """Time without estimates after which the witness raises its alarm [s]."""
        chosen = self.witness.stale_after if self.witness else None
        return chosen or max(1.0, 3.0 * self.interval)


_KIND = "adapter"
"""Key of the sections that replace one another as a whole: devices."""


def load_rig(path: Path | str) -> RigConfig:
    """The configuration at `path`; relative paths in it stay relative to the working folder.

    Raises:
        ConfigError: the file is invalid, two channels have the same name, or silence would count
            as stale between two samples.
    """
    config = load_layered(path, RigConfig, _KIND)
    names = [channel.name for channel in config.channels]
    if len(set(names)) < len(names):
        file = holder(path, "channels")
        raise ConfigError(file, "channels", f"the names {', '.join(names)}", "different names")
    chosen = {"daq": config.stale_after, "witness": config.unwatched_after}
    for section, silence in chosen.items():
        if silence < 2.0 * config.interval:
            least = f"at least {2.0 * config.interval:.3g} s, two periods or polls of the device"
            key, found = f"{section}.stale_after", f"{silence:g} s"
            raise ConfigError(holder(path, section), key, found, least)
    _check_thinning(config.recorder or RecorderSection(), path)
    return config


def _check_thinning(recorder: RecorderSection, path: Path | str) -> None:
    """Sessions have an end, and are thinned before they are removed."""
    limits = {"thin_days": recorder.keep_days, "thin_alarm_days": recorder.keep_alarm_days}
    for name, removed in limits.items():
        days, key = getattr(recorder, name), f"recorder.{name}"
        if days and not recorder.session_days:
            found = f"{days:g} days, of sessions that do not end"
            raise ConfigError(holder(path, "recorder"), key, found, "also recorder.session_days")
        if days and removed and removed <= days:
            found = f"{days:g} days, of recordings that are removed after {removed:g} days"
            raise ConfigError(holder(path, "recorder"), key, found, "thinning before removal")


def rig_text(path: Path | str) -> str:
    """The text of the configuration at `path`; with a base, the text of both together.

    Raises:
        ConfigError: a file cannot be read.
    """
    return whole_text(path, _KIND)


def section_or_error(config: RigConfig, name: str, path: Path | str) -> Section:
    """The optional section `name` of `config`.

    Raises:
        ConfigError: the file has no such section.
    """
    section: Section | None = getattr(config, name)
    if section is None:
        raise ConfigError(path, name, "no such section", f"a section [{name}]")
    return section
