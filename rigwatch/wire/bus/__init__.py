"""The bus between the processes of a rig: messages, queries and liveliness.

    Bus             what processes use: messages are encoded and checked here
     └ Transport    what carries the bytes: Zenoh, or memory in tests

`connect` joins the bus of a rig. `alarm_list` and `model_change` are the two queries that the
monitor answers.
"""

from rigwatch.wire.bus.alarm_command import command_alarms
from rigwatch.wire.bus.alarm_list import ask_alarm_list, serve_alarm_list
from rigwatch.wire.bus.bus import Bus, unique_process
from rigwatch.wire.bus.complete_subscription import CompleteSubscription, Place
from rigwatch.wire.bus.connection import connect, open_router
from rigwatch.wire.bus.model_change import KEY, PATIENCE, ModelReply, ModelRequest, ask_for_model
from rigwatch.wire.bus.ring_questions import RingQuestions
from rigwatch.wire.bus.security import (
    REGISTER,
    ROLES,
    Issued,
    Register,
    authority_file,
    key_files,
)
from rigwatch.wire.bus.subscription import QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.transport import MAX_PAYLOAD, Close

__all__ = [
    "KEY",
    "MAX_PAYLOAD",
    "PATIENCE",
    "QUEUE_CAPACITY",
    "REGISTER",
    "ROLES",
    "Bus",
    "Close",
    "CompleteSubscription",
    "Issued",
    "ModelReply",
    "ModelRequest",
    "Place",
    "Register",
    "RingQuestions",
    "Subscription",
    "ask_alarm_list",
    "ask_for_model",
    "authority_file",
    "command_alarms",
    "connect",
    "key_files",
    "open_router",
    "serve_alarm_list",
    "unique_process",
]
