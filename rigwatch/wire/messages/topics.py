"""The one table of topics: name, key, message, publisher, rate, recorded or not."""

from dataclasses import dataclass

from rigwatch.wire.messages.message_types import (
    Alarm,
    AlarmCommand,
    EstimateBlock,
    Event,
    Gap,
    Health,
    Message,
    ModelChange,
    RunInfo,
    SampleBlock,
)

MOST_RARE = 1.0
"""Rate in normal running up to which a topic's messages are few [Hz]."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One line of the table.

    Attributes:
        name: its name in code and session files.
        key: key on the bus below `rig/<id>/`.
        message: class of its messages.
        publisher: the process that publishes it.
        rate_hz: messages a second at most in normal running [Hz]; 0 for now and then.
        recorded: whether the recorder keeps it.
        numbered: whether its publisher numbers and stores its messages, so that a listener gets
            each message once or a report of the missing ones.
        joined: whether a process of several rigs sends its messages as one with those of its other
            rigs, to such processes: they are many.
        owned_by: processes whose messages decide alarms, or what a recording lacks: each has a key
            of its own, at which no other role may send.
    """

    name: str
    key: str
    message: type[Message]
    publisher: str
    rate_hz: float
    recorded: bool
    numbered: bool = False
    joined: bool = False
    owned_by: tuple[str, ...] = ()

    @property
    def is_rare(self) -> bool:
        """Whether its messages are few in normal running."""
        return self.rate_hz <= MOST_RARE

    def key_of(self, process: str) -> str:
        """Key at which a process sends."""
        return f"{self.key}/{process}" if process in self.owned_by else self.key

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys at which its messages arrive."""
        return (self.key, *map(self.key_of, self.owned_by))


SAMPLES = Topic("samples", "daq/samples", SampleBlock, "daq", 256.0, recorded=True, joined=True)
ESTIMATES = Topic(
    "estimates", "monitor/estimates", EstimateBlock, "monitor", 256.0,
    recorded=True, numbered=True, joined=True,
)  # fmt: skip
ALARMS = Topic("alarms", "monitor/alarms", Alarm, "monitor", 0.0, recorded=True, numbered=True)
COMMANDS = Topic("commands", "monitor/commands", AlarmCommand, "operator", 0.0, recorded=True)
GAPS = Topic("gaps", "gaps", Gap, "any", 0.0, recorded=True, owned_by=("recorder",))
HEALTH = Topic(
    "health", "health", Health, "any", 1.0,
    recorded=True, joined=True, owned_by=("daq", "recorder"),
)  # fmt: skip
EVENTS = Topic("events", "events", Event, "any", 0.0, recorded=True)
RUN = Topic("run", "run", RunInfo, "recorder", 0.0, recorded=True)
MODELS = Topic(
    "models", "monitor/models", ModelChange, "monitor", 0.0, recorded=True, numbered=True
)

TOPICS: tuple[Topic, ...] = (
    SAMPLES,
    ESTIMATES,
    ALARMS,
    COMMANDS,
    GAPS,
    HEALTH,
    EVENTS,
    RUN,
    MODELS,
)
_BY_CLASS = {line.message: line for line in TOPICS}

RECORDERS = (RUN.publisher, "headquarters")
"""The recorder of a rig at its own site, and one at another."""
RING_KEY = "daq/ring"
"""Key of the adapter's ring of recent samples, queried by readers that missed some."""
PAST_KEY = "recorder/past"
"""Key at which a recorder answers for its sessions."""
ALIVE_KEY = "alive"
"""Liveliness tokens are at `alive/<process>`."""


def is_source(reporter: str) -> bool:
    """Whether a reporter names a data acquisition: "daq/rig"."""
    return reporter.partition("/")[0] == SAMPLES.publisher


def topic_of(message: Message) -> Topic:
    """The topic that carries messages of this class."""
    return _BY_CLASS[type(message)]


def topic(name: str) -> Topic:
    """The topic called `name`; KeyError if there is none."""
    for line in TOPICS:
        if line.name == name:
            return line
    raise KeyError(name)


def bus_key(rig: str, key: str) -> str:
    """The whole key on the bus, such as "rig/bench1/daq/samples"."""
    return f"rig/{rig}/{key}"
