"""All alarms in one table: name, severity, cause, guidance and default settings.

An alarm is named after the condition that raises it. A sensor alarm exists per channel and is named
`<kind>.<channel>`, such as "sensor_stuck.position"; `{channel}` in its texts stands for the
channel. Severities follow EEMUA 191: critical means that the rig is no longer monitored, info is a
remark that needs no acknowledgement. An alarm that `refines` another names the same fault more
precisely and replaces it.
"""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import Severity
from rigwatch.wire.rig_config import AlarmSection


@dataclass(frozen=True, slots=True)
class AlarmSettings:
    """How a condition becomes an alarm, with every default filled in.

    Attributes:
        persistence: consecutive samples with the condition before the alarm is raised [1].
        clear_after: consecutive samples without the condition before it counts as gone [1].
        latch: an operator must reset the alarm after the condition has gone.
        enabled: whether the alarm is raised at all.
    """

    persistence: int
    clear_after: int
    latch: bool
    enabled: bool = True


@dataclass(frozen=True, slots=True)
class AlarmKind:
    """One row of the table.

    Attributes:
        name: the condition that raises it; for a sensor alarm the part before the dot.
        severity: of the alarm; "info" needs no acknowledgement.
        cause: the probable cause.
        guidance: what the operator should do.
        defaults: settings if the configuration gives none.
        safety: the rig should be stopped; a flood never groups it.
        refines: the alarm that this one replaces, "" for none.
    """

    name: str
    severity: Severity
    cause: str
    guidance: str
    defaults: AlarmSettings
    refines: str = ""
    safety: bool = False

    @property
    def always_shown(self) -> bool:
        """Whether a flood never groups it."""
        return self.safety or self.severity == "critical"


_LASTING = AlarmSettings(persistence=2, clear_after=256, latch=True)
_AT_ONCE = AlarmSettings(persistence=1, clear_after=256, latch=True)
_PASSING = AlarmSettings(persistence=1, clear_after=256, latch=False)
_SENSOR = AlarmSettings(persistence=3, clear_after=256, latch=True)
_REMARK = AlarmSettings(persistence=1, clear_after=64, latch=False)

ALARM_FLOOD = "alarm_flood"

ALARM_KINDS: tuple[AlarmKind, ...] = (
    # The link to the rig: without it no other condition can be judged.
    AlarmKind(
        "link",
        "critical",
        "nothing connects the monitor with the device any more",
        "The reason names what is away. The device: check its power, the cable and the port. "
        "Another device: put the right one back, or `rigwatch accept CONFIG`. The router or data "
        "acquisition: check that it runs (`rigwatch doctor CONFIG`). The connection is restored by "
        "itself; lost samples are counted.",
        _AT_ONCE,
    ),
    AlarmKind(
        "stale",
        "critical",
        "no samples arrive although the line is open",
        "Check that device and daq are running (`rigwatch doctor CONFIG`). If they are, this "
        "machine may be too busy to read them in time: check that the load that `uptime` prints is "
        "below the number of cores (`nproc`). Do not trust the last values.",
        _AT_ONCE,
    ),
    AlarmKind(
        "duplicate_source",
        "critical",
        "a second process or device sends samples of this rig; those of one are used",
        "Find and stop it; a second daq needs a rig id of its own, a second device a line of its "
        "own.",
        _AT_ONCE,
    ),
    AlarmKind(
        "loss",
        "error",
        "samples were lost and could not be recovered",
        "The recording shows the gaps. Check the machine's load and the line's error counters.",
        _AT_ONCE,
    ),
    AlarmKind(
        "gap",
        "warning",
        "samples are missing; the estimates start again",
        "New estimates follow in seconds. If it repeats, check the line and the machine's load.",
        _PASSING,
    ),
    AlarmKind(
        "line_noise",
        "error",
        "more than 1 % of the bytes from the device are not valid data",
        "Check the cable, its shield and length, and the baud rate. `crc_errors` and "
        "`skipped_bytes` count the errors.",
        _AT_ONCE,
    ),
    AlarmKind(
        "slow_device",
        "warning",
        "the device delivers less than 90 % of its nominal sample rate",
        "Check the device's load and the line's speed, and that rig.sample_rate is right.",
        _PASSING,
    ),
    AlarmKind(
        "estimates_missing",
        "critical",
        "samples arrive, but the monitor computes nothing from them",
        "The rig is not being monitored. The monitor's health message gives the reason.",
        _AT_ONCE,
    ),
    AlarmKind(
        "clock_drift",
        "warning",
        "the device's clock runs faster or slower than this machine's",
        "Compare `rate_hz` in the health message with the nominal rate; check the device's "
        "oscillator.",
        _PASSING,
    ),
    AlarmKind(
        "clock_wrong",
        "error",
        "the device's clock is off by more than 0.5 %, so frequencies and rates are wrong",
        "Do not trust frequencies, velocities and accelerations. Check the device's oscillator "
        "and rig.sample_rate.",
        _AT_ONCE,
    ),
    AlarmKind(
        "disk",
        "error",
        "the disk is full or nearly full; recording and alarm journal may stop",
        "Free space or mount another disk. Monitoring continues; what is not recorded is counted.",
        _AT_ONCE,
    ),
    AlarmKind(
        "disk_almost_full",
        "critical",
        "less than 2 % of the recording's disk is free; recording is about to stop",
        "Free space now: remove old sessions, or set recorder.keep_days or keep_gigabytes.",
        _AT_ONCE,
    ),
    AlarmKind(
        "recording_stopped",
        "critical",
        "nothing is being recorded",
        "Check the disk and the recorder's process. Monitoring continues; a recorder that returns "
        "fetches recent samples.",
        _AT_ONCE,
    ),
    AlarmKind(
        "certificates_end",
        "error",
        "certificates end within a month, or have ended: the next restart of router or machine "
        "would leave the rig unwatched",
        "Issue them anew with `rigwatch keys issue`. Processes on this machine take them up "
        "without a restart; copy those of other machines there before `register.json`.",
        _AT_ONCE,
    ),
    AlarmKind(
        "monitor_reset",
        "error",
        "a filter of the monitor diverged and was reset",
        "Estimates are valid again within seconds. If it repeats, see the event log and "
        "commission again.",
        _AT_ONCE,
    ),
    # The wiring, checked over the first seconds of motion.
    AlarmKind(
        "wiring_sign",
        "critical",
        "position and acceleration have opposite signs; the rig is not monitored",
        "Reverse the sensor or its gain in the configuration, then restart the monitor. If all is "
        "as it is to be: `rigwatch accept CONFIG wiring_sign`.",
        _AT_ONCE,
    ),
    AlarmKind(
        "wiring_scale",
        "critical",
        "acceleration and position disagree about the size of the motion; the rig is not monitored",
        "Check unit, gain and range of both channels (mm or m, g or m/s^2, range of the "
        "amplifier), then restart the monitor. If all is as it is to be: `rigwatch accept CONFIG "
        "wiring_scale`.",
        _AT_ONCE,
    ),
    AlarmKind(
        "wiring_swapped",
        "critical",
        "position and acceleration do not show the same motion; the rig is not monitored",
        "Look for swapped channels, a reversed sensor behind a filter, or a sensor on another "
        "part, then restart the monitor. If all is as it is to be: `rigwatch accept CONFIG "
        "wiring_swapped`.",
        _AT_ONCE,
    ),
    AlarmKind(
        "wiring_drive",
        "critical",
        "the rig answers its drive five times as strongly as its model or a fifth as strongly, or "
        "with the other sign; the rig is not monitored",
        "Check sign, unit, gain and range of the drive's channel, and that this device is of the "
        "rig that the model was made of, then restart the monitor. If all is right, make the model "
        "anew, or `rigwatch accept CONFIG wiring_drive`.",
        _AT_ONCE,
    ),
    # The sensors: one alarm per channel.
    AlarmKind(
        "sensor_non_finite",
        "error",
        "the {channel} channel delivers no valid number",
        "Check the sensor, its supply and its calibration. The channel is kept out of all "
        "estimates.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_saturated",
        "warning",
        "the {channel} signal is at its limit or outside the sensor's range",
        "Lower the excitation or choose another range. Saturated samples are kept out of the "
        "estimates.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_clipped",
        "error",
        "the {channel} signal is clipped inside the sensor's range",
        "Check the sensor's amplifier, supply and range. Do not trust estimates that need this "
        "channel.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_jumped",
        "error",
        "the {channel} signal has jumped faster than the rig can move",
        "Check the sensor's mounting, wiring and zero, and whether it was touched. Dry friction "
        "is not named for a second after a jump.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_stuck",
        "error",
        "the {channel} reading does not change, not even by noise",
        "Check the sensor's wiring and supply; move the rig by hand and watch the channel. For a "
        "set value that may be held, set stuck_after = 0.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_stale",
        "error",
        "the {channel} channel repeats an old value",
        "Check how the device samples this channel.",
        _SENSOR,
    ),
    AlarmKind(
        "sensor_spike",
        "warning",
        "the {channel} signal changed three times within a second faster than the sensor can",
        "Look for a loose contact or electrical interference near the sensor's cable.",
        _AT_ONCE,
    ),
    AlarmKind(
        "sensor_invalid",
        "error",
        "a channel that the estimates need has been invalid for too long",
        "The sensor's own alarm names the channel. Estimates resume once it is valid.",
        _AT_ONCE,
    ),
    # The rig itself.
    AlarmKind(
        "departure",
        "error",
        "the rig no longer behaves like its healthy model; the fault is being identified",
        "Keep the excitation running: identification takes a few periods of the motion. Be ready "
        "to stop.",
        _LASTING,
    ),
    AlarmKind(
        "dry_friction",
        "error",
        "dry friction: bearing pressure too low, wear, side load or dirt",
        "Stop soon. Check the air bearing's supply, then alignment, seals and guides.",
        _LASTING,
        refines="departure",
        safety=True,
    ),
    AlarmKind(
        "stiction",
        "error",
        "stiction: the mass sticks and breaks away in jerks",
        "Stop now. The bearing touches or a part is jammed; restore the air supply before moving "
        "again.",
        _LASTING,
        refines="departure",
        safety=True,
    ),
    AlarmKind(
        "other_fault",
        "error",
        "the rig has changed in a way that dry friction does not explain",
        "Check sensors (gain, offset), supply pressure, valve and leaks; compare with a healthy "
        "recording.",
        _LASTING,
        refines="departure",
    ),
    # The detectors in addition to the friction scheme.
    AlarmKind(
        "parity_arma",
        "warning",
        "the position differs from the model's (ARMA parity residual above its threshold)",
        "Compare with the friction estimates; a constant residual points to a sensor offset.",
        _LASTING,
    ),
    AlarmKind(
        "parity_ma",
        "warning",
        "the position breaks the model's difference equation (MA parity residual above its "
        "threshold)",
        "Compare with the friction estimates; short bursts point to impacts or spikes.",
        _LASTING,
    ),
    AlarmKind(
        "unknown_input",
        "warning",
        "the measured position has a bias that the model does not explain",
        "Compare with the friction estimates; check the position sensor's zero and mounting.",
        _LASTING,
    ),
    # Remarks: why there is no verdict at present.
    AlarmKind(
        "excitation_changed",
        "warning",
        "the excitation differs from that of the healthy reference",
        "Return to the known excitation, or commission with a healthy recording of the new one.",
        _PASSING,
    ),
    AlarmKind(
        "reference_learnt",
        "info",
        "no healthy recording of this excitation: the start of this run counts as healthy, with "
        "any fault already present",
        "Make sure that the rig was healthy at the start, or commission with a healthy recording "
        "of this excitation.",
        _REMARK,
    ),
    AlarmKind(
        "not_armed",
        "info",
        "the monitor is settling after a start, a gap or a change of the drive; nothing is judged "
        "yet",
        "Wait two seconds. If it stays, look for alarms about samples.",
        _REMARK,
    ),
    AlarmKind(
        "not_judged",
        "warning",
        "the motion is outside the range that commissioning covered; only dry friction is judged",
        "Return to a motion that commissioning covered, or commission again with a healthy "
        "recording of this one.",
        _PASSING,
    ),
    AlarmKind(
        "drive_late",
        "info",
        "the drive acts later (+) or earlier (-) than in commissioning",
        "Where the generator was started again or replaced, nothing is wrong. Where it was not, "
        "something has changed that acts like it at this motion, such as mass or stiffness: look "
        "at another frequency, or explain a recording.",
        _REMARK,
    ),
    AlarmKind(
        "not_observable",
        "info",
        "too little motion to estimate friction; the estimates are frozen",
        "Nothing is wrong. Move the rig to monitor its friction.",
        _REMARK,
    ),
    AlarmKind(
        "ill_conditioned",
        "info",
        "this motion cannot distinguish dry from viscous friction; the estimates are frozen",
        "Nothing is wrong. Vary the amplitude or the frequency of the excitation.",
        _REMARK,
    ),
    AlarmKind(
        ALARM_FLOOD,
        "error",
        "more than ten alarms in ten minutes; further ones are grouped, except critical ones",
        "Look at the first-out alarm: it is probably the cause of the others.",
        _PASSING,
    ),
)

REPORTED = frozenset(
    (
        "link", "stale", "duplicate_source", "loss", "line_noise", "slow_device", "clock_drift",
        "clock_wrong", "disk", "disk_almost_full", "recording_stopped", "estimates_missing",
        "certificates_end",
    )
)  # fmt: skip
"""Alarms whose conditions processes report without a sample."""
REFINED = tuple(dict.fromkeys(kind.refines for kind in ALARM_KINDS if kind.refines))
"""Alarms that others refine."""

_BY_NAME = {kind.name: kind for kind in ALARM_KINDS}
_ORDER = {kind.name: place for place, kind in enumerate(ALARM_KINDS)}


def split(name: str) -> tuple[str, str]:
    """Kind and channel of an alarm's name; the channel is "" if there is none."""
    kind, _, channel = name.partition(".")
    return kind, channel


def kind_of(name: str) -> AlarmKind:
    """The table's row for the alarm `name`; a plain warning for an unlisted condition."""
    kind, _ = split(name)
    if kind in _BY_NAME:
        return _BY_NAME[kind]
    words = kind.replace("_", " ")
    return AlarmKind(kind, "warning", words, "See the event log and the recording.", _LASTING)


def order_of(name: str) -> tuple[int, str]:
    """Order of the alarm `name` among alarms raised by one sample: nearest to the cause first."""
    return _ORDER.get(split(name)[0], len(_ORDER)), name


def settings_of(name: str, settings: Mapping[str, AlarmSection]) -> AlarmSettings:
    """Settings of the alarm `name`: its own section, else its kind's, else the table's defaults."""
    defaults = kind_of(name).defaults
    section = settings.get(name) or settings.get(split(name)[0])
    if section is None:
        return defaults
    return AlarmSettings(
        persistence=defaults.persistence if section.persistence is None else section.persistence,
        clear_after=defaults.clear_after if section.clear_after is None else section.clear_after,
        latch=defaults.latch if section.latch is None else section.latch,
        enabled=section.enabled,
    )


def check_settings(settings: Mapping[str, AlarmSection], file: Path | str) -> None:
    """Check that settings name existing alarms.

    Raises:
        ConfigError: a section under [monitor.alarms] names no alarm of the table.
    """
    for name in settings:
        if split(name)[0] not in _BY_NAME:
            near = difflib.get_close_matches(split(name)[0], _BY_NAME, n=1)
            expected = f"{near[0]}" if near else f"one of {', '.join(_BY_NAME)}"
            raise ConfigError(file, f"monitor.alarms.{name}", "no such alarm", expected)
