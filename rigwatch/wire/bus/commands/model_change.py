"""Requests to a running monitor to use another model, or to restore the previous one."""

import msgspec

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.commands.model_request import ModelReply, ModelRequest
from rigwatch.wire.bus.transport import MAX_PAYLOAD
from rigwatch.wire.errors import BusError, ModelError
from rigwatch.wire.typed_files import JsonError, json_value

KEY = "monitor/model"
PATIENCE = 30.0
"""Longest time in which a monitor replies, the writing of its files to a slow disk included [s]."""


def ask_for_model(bus: Bus, request: ModelRequest, timeout: float = PATIENCE) -> ModelReply:
    """Sign and send the request, and wait for the reply.

    Raises:
        BusError: no monitor answers.
        KeysError: the operator's key cannot be read.
        ModelError: the request is larger than the bus carries; nothing changes.
    """
    question = msgspec.json.encode(signed(bus, request))
    if len(question) > MAX_PAYLOAD:
        size = f"found a request of {len(question)} bytes, expected at most {MAX_PAYLOAD}"
        raise ModelError(f"the new model is too large for a running monitor: {size}")
    for reply in bus.query(KEY, question, timeout):
        try:
            return json_value(reply, ModelReply)
        except JsonError:
            continue
    raise BusError(f"no monitor of rig {bus.rig} answers: start `rigwatch monitor`")
