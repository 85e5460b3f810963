"""What operators ask of a rig, signed: alarms acknowledged or shelved, another model or device."""

from rigwatch.wire.bus.commands.alarm_command import CommandAnswer, command_alarms
from rigwatch.wire.bus.commands.alarm_list import ask_alarm_list, serve_alarm_list
from rigwatch.wire.bus.commands.command_check import (
    CommandCheck,
    Verdict,
    command_mark,
    proved_here,
)
from rigwatch.wire.bus.commands.device_change import (
    DEVICE_KEY,
    DEVICE_RUN_KEY,
    accept_device,
    ask_for_device,
)
from rigwatch.wire.bus.commands.device_request import DeviceReply, DeviceRequest
from rigwatch.wire.bus.commands.model_change import KEY, PATIENCE, ask_for_model
from rigwatch.wire.bus.commands.model_request import ModelReply, ModelRequest
from rigwatch.wire.bus.commands.refusal import marked
from rigwatch.wire.bus.commands.shelf import ShelvedAlarm, ask_shelf, serve_shelf, shelf_line
from rigwatch.wire.bus.commands.taken import TakenAt, taken, taken_at

__all__ = [
    "DEVICE_KEY",
    "DEVICE_RUN_KEY",
    "KEY",
    "PATIENCE",
    "CommandAnswer",
    "CommandCheck",
    "DeviceReply",
    "DeviceRequest",
    "ModelReply",
    "ModelRequest",
    "ShelvedAlarm",
    "TakenAt",
    "Verdict",
    "accept_device",
    "ask_alarm_list",
    "ask_for_device",
    "ask_for_model",
    "ask_shelf",
    "command_alarms",
    "command_mark",
    "marked",
    "proved_here",
    "serve_alarm_list",
    "serve_shelf",
    "shelf_line",
    "taken",
    "taken_at",
]
