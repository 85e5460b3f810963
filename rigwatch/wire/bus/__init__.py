"""The bus between the processes of a rig: messages, queries and liveliness.

    Bus             what processes use: messages are encoded and checked here
     └ Transport    what carries the bytes: Zenoh, or memory in tests

`connect` joins the bus of a rig. `commands` are what operators ask of its monitor and daq.
"""

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands import (
    DEVICE_KEY,
    DEVICE_RUN_KEY,
    KEY,
    PATIENCE,
    CommandAnswer,
    CommandCheck,
    DeviceReply,
    DeviceRequest,
    ModelReply,
    ModelRequest,
    ShelvedAlarm,
    TakenAt,
    Verdict,
    accept_device,
    ask_alarm_list,
    ask_for_device,
    ask_for_model,
    ask_shelf,
    command_alarms,
    command_mark,
    marked,
    proved_here,
    serve_alarm_list,
    serve_shelf,
    shelf_line,
    taken,
    taken_at,
)
from rigwatch.wire.bus.complete_subscription import CompleteSubscription, Place
from rigwatch.wire.bus.connection import (
    SharedLinks,
    connect,
    joined,
    log_refusals,
    open_router,
)
from rigwatch.wire.bus.inbox import Inbox
from rigwatch.wire.bus.kept_messages import KeptMessages, kept_runs
from rigwatch.wire.bus.member import unique_process
from rigwatch.wire.bus.message_ring import LARGEST_NUMBERED, SAID_KEY, MessageRing
from rigwatch.wire.bus.ring_questions import RingQuestions
from rigwatch.wire.bus.several import LARGEST as LARGEST_JOINED
from rigwatch.wire.bus.several import (
    MOST_PARTS,
    JointReceiver,
    Part,
    Share,
    Source,
    join,
    split,
)
from rigwatch.wire.bus.subscription import MOST_COMMANDS, QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.tokens import sender_named
from rigwatch.wire.bus.transport import (
    DENIED_MARK,
    LINK_MARK,
    MAX_PAYLOAD,
    REFUSED_MARK,
    SILENT_MARK,
    Close,
    Joining,
)

__all__ = [
    "DENIED_MARK",
    "DEVICE_KEY",
    "DEVICE_RUN_KEY",
    "KEY",
    "LARGEST_JOINED",
    "LARGEST_NUMBERED",
    "LINK_MARK",
    "MAX_PAYLOAD",
    "MOST_COMMANDS",
    "MOST_PARTS",
    "PATIENCE",
    "QUEUE_CAPACITY",
    "REFUSED_MARK",
    "SAID_KEY",
    "SILENT_MARK",
    "Bus",
    "Close",
    "CommandAnswer",
    "CommandCheck",
    "CompleteSubscription",
    "DeviceReply",
    "DeviceRequest",
    "Inbox",
    "Joining",
    "JointReceiver",
    "KeptMessages",
    "MessageRing",
    "ModelReply",
    "ModelRequest",
    "Part",
    "Place",
    "RingQuestions",
    "Share",
    "SharedLinks",
    "ShelvedAlarm",
    "Source",
    "Subscription",
    "TakenAt",
    "Verdict",
    "accept_device",
    "ask_alarm_list",
    "ask_for_device",
    "ask_for_model",
    "ask_shelf",
    "command_alarms",
    "command_mark",
    "connect",
    "join",
    "joined",
    "kept_runs",
    "log_refusals",
    "marked",
    "open_router",
    "proved_here",
    "sender_named",
    "serve_alarm_list",
    "serve_shelf",
    "shelf_line",
    "split",
    "taken",
    "taken_at",
    "unique_process",
]
