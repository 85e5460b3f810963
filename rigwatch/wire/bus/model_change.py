"""Requests to a running monitor to use another model, or to restore the previous one."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.command_check import signed
from rigwatch.wire.errors import BusError
from rigwatch.wire.typed_files import JsonError, json_value

KEY = "monitor/model"
PATIENCE = 3.0
"""Longest time in which a monitor replies [s]."""


@dataclass(frozen=True, slots=True)
class ModelRequest:
    """A model-change request.

    Attributes:
        action: "promote" this model, or "rollback" to the previous version.
        model: the model file's text; empty for a rollback.
        user: who makes the request.
        text: the reason.
        proof: the operator's signature, or without keys that of the account.
    """

    action: Literal["promote", "rollback"]
    model: str
    user: str
    text: str
    proof: str = ""


@dataclass(frozen=True, slots=True)
class ModelReply:
    """The monitor's reply.

    Attributes:
        done: whether the new model is in force.
        text: why not, or since when it is.
        boot, seq: the first sample processed with it.
    """

    done: bool
    text: str
    boot: int = 0
    seq: int = 0


def ask_for_model(bus: Bus, request: ModelRequest, timeout: float = PATIENCE) -> ModelReply:
    """Sign and send the request, and wait for the reply.

    Raises:
        BusError: no monitor answers.
        KeysError: the operator's key cannot be read.
    """
    question = msgspec.json.encode(signed(bus, request))
    for reply in bus.query(KEY, question, timeout):
        try:
            return json_value(reply, ModelReply)
        except JsonError:
            continue
    raise BusError(f"no monitor of rig {bus.rig} answers: start `rigwatch monitor`")
