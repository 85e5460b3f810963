"""The messages between processes and in session files, one declaration each.

Every message is a frozen dataclass. Its protobuf schema is built from the annotations
(`protobuf.py`), so that the bus and the session files carry the same bytes and any protobuf or MCAP
tool can read them. A field's number on the wire is its place in the class: new fields go to the
end, none is removed or moved.

Time stamps `t_ns` are Unix time in nanoseconds, taken from the device's clock mapped to host time.
Samples and everything computed from them carry `(boot, seq)`: `boot` is drawn anew by the device at
each start, `seq` counts its samples from 0.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.messages.quality_flags import valid

ByteArray = NDArray[np.uint8]

Severity = Literal["info", "warning", "error", "critical"]
AlarmState = Literal["normal", "unacknowledged", "acknowledged", "cleared_unacknowledged"]
"""States of ISA-18.2: active and not yet seen, active and seen, gone before it was seen."""
AlarmAction = Literal["acknowledge", "reset", "shelve", "unshelve"]
Identity = Literal["", "proved", "not proved"]
"""Whether the user of a command is proved; "" without a user."""
PROVED: Identity = "proved"
NOT_PROVED: Identity = "not proved"


@dataclass(frozen=True, slots=True)
class Column:
    """One signal over the samples of a block.

    Attributes:
        name: channel or signal name, such as "voltage".
        unit: SI unit, "" for a pure number.
        values: shape (n,).
        quality: shape (n,), flags of `quality_flags.py`; empty if the signal has none.
    """

    name: str
    unit: str
    values: FloatArray
    quality: ByteArray = field(default_factory=lambda: np.zeros(0, np.uint8))

    def usable(self) -> FloatArray:
        """The values, NaN if invalid or not a number; shape (n,)."""
        good = np.isfinite(self.values)
        if len(self.quality):
            good &= valid(self.quality)
        return np.where(good, self.values, np.nan)


Names = tuple[tuple[str, str], ...]
"""Name and unit of each column."""


@dataclass(frozen=True, slots=True, eq=False)
class ColumnTable(Sequence[Column]):
    """Columns without quality flags, in order, whose numbers are the rows of one array.

    A `Column` for each of twenty signals costs more than the numbers of a block of some samples, so
    it is made when somebody asks for it.

    Attributes:
        names: of the rows.
        values: shape (columns, n).
    """

    names: Names
    values: FloatArray

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Column]:
        for (name, unit), row in zip(self.names, self.values, strict=True):
            yield Column(name, unit, row, np.zeros(0, np.uint8))

    @overload
    def __getitem__(self, place: int) -> Column: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Column, ...]: ...
    def __getitem__(self, place: int | slice) -> Column | tuple[Column, ...]:
        if isinstance(place, slice):
            return tuple(self)[place]
        name, unit = self.names[place]
        return Column(name, unit, self.values[place], np.zeros(0, np.uint8))

    def named(self, name: str) -> Column:
        """The column called `name`; KeyError if there is none."""
        for place, (known, _) in enumerate(self.names):
            if known == name:
                return self[place]
        raise KeyError(name)

    def cut(self, part: slice) -> "ColumnTable":
        """The same columns over a part of the samples; a view."""
        return ColumnTable(self.names, self.values[:, part])


@dataclass(frozen=True, slots=True)
class SampleBlock:
    """Consecutive samples of one device: `seq`, `seq + 1`, … `seq + n - 1`.

    Attributes:
        device: the device's name in the configuration.
        boot: drawn by the device at its start.
        seq: number of the first sample.
        device_us: shape (n,), device clock, unwrapped [µs].
        t_ns: shape (n,), Unix time [ns].
        channels: calibrated signals in SI units, each of length n.
    """

    device: str
    boot: int
    seq: int
    device_us: IntArray
    t_ns: IntArray
    channels: tuple[Column, ...]

    def __len__(self) -> int:
        return len(self.t_ns)

    def channel(self, name: str) -> Column:
        """The channel called `name`; KeyError if there is none."""
        for column in self.channels:
            if column.name == name:
                return column
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class EstimateBlock:
    """Results of the monitor for consecutive samples.

    Attributes:
        device: the device whose samples these were.
        boot: boot of those samples.
        seq: number of the first sample.
        t_ns: shape (n,), time of the samples [ns].
        columns: one column a published field, each of length n.
    """

    device: str
    boot: int
    seq: int
    t_ns: IntArray
    columns: Sequence[Column]

    def __len__(self) -> int:
        return len(self.t_ns)

    def column(self, name: str) -> Column:
        """The field called `name`; KeyError if there is none."""
        if isinstance(self.columns, ColumnTable):
            return self.columns.named(name)
        for column in self.columns:
            if column.name == name:
                return column
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples, or messages of `topic`, lost to a reader: `first` to `last`, inclusive.

    `last` below `first` means an unknown number (the device restarted meanwhile). For messages
    `device` is the process that sent them, `boot` its run. An empty topic means samples.
    """

    device: str
    boot: int
    first: int
    last: int
    t_ns: int
    reporter: str
    reason: str
    topic: str = ""


@dataclass(frozen=True, slots=True)
class Health:
    """State of a process, published about once a second.

    Attributes:
        source: the process, such as "daq/rig1".
        t_ns: time of the message [ns].
        state: one word for people: "running", "stale", "reconnecting", "stopped", …
        text: one plain line, empty without a problem.
        counters: figures by name, unit in the name (`rate_hz`, `lost_samples`, `crc_errors`).
    """

    source: str
    t_ns: int
    state: str
    text: str
    counters: Mapping[str, float]


PROBABLY_MISSING = "PROBABLY MISSING"
EVERY_ALARM = "*"
"""Name in a command that addresses all alarms."""
LONGEST_NAME, LONGEST_TEXT = 100, 500
"""Longest names and text of a command that are kept [characters]."""
MONITOR_STALE = "monitor_stale"
"""The alarm that the witness raises."""
STATISTIC = "statistic"
"""The estimate that every watched structure has and no monitor."""
STRUCTURE_DAMAGE = "structure_damage"
"""The alarm of a structure that is watched; it is in no list of standing alarms, all others are the
monitor's."""


@dataclass(frozen=True, slots=True)
class Event:
    """A single occurrence for the log.

    With the code `PROBABLY_MISSING` its text is an alarm's name, ": ", and the result of the
    ranking.
    """

    source: str
    t_ns: int
    severity: Severity
    code: str
    text: str


@dataclass(frozen=True, slots=True)
class Alarm:
    """One transition of one alarm, or its better value in the same state (`transitions`).

    Attributes:
        name: the alarm, such as "dry_friction" or "link".
        state: the state it is in from now on.
        severity: from info to critical.
        cause: the probable cause, in words.
        guidance: the recommended action, in words.
        device, boot, seq, t_ns: the sample that decided; seq -1 if no sample did.
        value, low, high: the value and the limits it exceeded; NaN if there are none.
        first_out: whether it was the first of its flood.
        user: the operator, for transitions by an operator.
        onset_seq: the first sample at which the condition held; earlier than the alarm by its
            persistence.
        identity: whether the user was proved by a signature.
    """

    name: str
    state: AlarmState
    severity: Severity
    cause: str
    guidance: str
    device: str
    boot: int
    seq: int
    t_ns: int
    value: float
    low: float
    high: float
    first_out: bool
    user: str
    onset_seq: int
    identity: Identity = ""

    def guidance_for(self, config: str) -> str:
        """The recommended action, its commands with the rig's configuration file."""
        return self.guidance.replace("CONFIG", config)


@dataclass(frozen=True, slots=True)
class AlarmCommand:
    """An operator's command for an alarm; `name` "*" means all.

    `proof` is the operator's signature (`rigwatch.wire.access`), "" on a rig without keys.
    """

    name: str
    action: AlarmAction
    user: str
    t_ns: int
    text: str = ""
    proof: str = ""


@dataclass(frozen=True, slots=True)
class RunInfo:
    """Configuration and origin of a run; written at the head of every session segment.

    Attributes:
        rig: the rig's id.
        t_ns: start of the run [ns].
        sample_rate_hz: nominal rate [Hz].
        configuration: text of the configuration file.
        configuration_sha256: its hash.
        software: name and version of the writer.
        notes: free text, such as the origin of imported data and changes to them.
    """

    rig: str
    t_ns: int
    sample_rate_hz: float
    configuration: str
    configuration_sha256: str
    software: str
    notes: str


@dataclass(frozen=True, slots=True)
class ModelChange:
    """The monitor continues with another model.

    Attributes:
        device, boot, seq: the first sample that is judged with it; seq 0 before any sample.
        t_ns: later than the last sample before, not later than that one [ns].
        user: who requested it.
        text: the reason, in words.
        model: the model file's text.
        previous: the text of the previous one; "" where a message has no room for both.
        identity: whether the user was proved by a signature.
    """

    device: str
    boot: int
    seq: int
    t_ns: int
    user: str
    text: str
    model: str
    previous: str
    identity: Identity = ""


Message = (
    SampleBlock
    | EstimateBlock
    | Gap
    | Health
    | Event
    | Alarm
    | AlarmCommand
    | RunInfo
    | ModelChange
)
SAID_BY_ANYBODY = (AlarmCommand, Event, Gap, Health)
"""Messages that every client of a bus may send, with times of its own."""
MESSAGE_TYPES: tuple[type[Message], ...] = (
    SampleBlock,
    EstimateBlock,
    Gap,
    Health,
    Event,
    Alarm,
    AlarmCommand,
    RunInfo,
    ModelChange,
)
