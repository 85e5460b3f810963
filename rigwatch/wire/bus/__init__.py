"""The bus between the processes of a rig: messages, queries and liveliness.

    Bus             what processes use: messages are encoded and checked here
     └ Transport    what carries the bytes: Zenoh, or memory in tests

`connect` joins the bus of a rig. `alarm_list` and `model_change` are the two queries that the
monitor answers.
"""

from rigwatch.wire.bus.alarm_command import command_alarms
from rigwatch.wire.bus.alarm_list import ask_alarm_list, serve_alarm_list
from rigwatch.wire.bus.bus import Bus, unique_process
from rigwatch.wire.bus.command_check import CommandCheck, Verdict, command_mark, proved_here
from rigwatch.wire.bus.complete_subscription import CompleteSubscription, Place
from rigwatch.wire.bus.connection import (
    SharedLinks,
    connect,
    joined,
    log_refusals,
    open_router,
)
from rigwatch.wire.bus.model_change import KEY, PATIENCE, ModelReply, ModelRequest, ask_for_model
from rigwatch.wire.bus.ring_questions import RingQuestions
from rigwatch.wire.bus.subscription import MOST_COMMANDS, QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.transport import DENIED_MARK, MAX_PAYLOAD, REFUSED_MARK, Close

__all__ = [
    "DENIED_MARK",
    "KEY",
    "MAX_PAYLOAD",
    "MOST_COMMANDS",
    "PATIENCE",
    "QUEUE_CAPACITY",
    "REFUSED_MARK",
    "Bus",
    "Close",
    "CommandCheck",
    "CompleteSubscription",
    "ModelReply",
    "ModelRequest",
    "Place",
    "RingQuestions",
    "SharedLinks",
    "Subscription",
    "Verdict",
    "ask_alarm_list",
    "ask_for_model",
    "command_alarms",
    "command_mark",
    "connect",
    "joined",
    "log_refusals",
    "open_router",
    "proved_here",
    "serve_alarm_list",
    "unique_process",
]
