"""Asking a running monitor to go on with another model, or to go back to the one before."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.errors import BusError

KEY = "monitor/model"
PATIENCE = 3.0
"""Longest that a monitor takes to answer [s]."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What an operator wants.

    Attributes:
        action: "promote" this model, or "rollback" to the version before.
        model: the model file's text; empty for a rollback.
        user: who asks.
        text: why, in words.
    """

    action: Literal["promote", "rollback"]
    model: str
    user: str
    text: str


@dataclass(frozen=True, slots=True)
class Granted:
    """What the monitor says.

    Attributes:
        done: whether the other model is in force.
        text: why not, or what is in force.
        boot, seq: the first sample that is judged with it.
    """

    done: bool
    text: str
    boot: int = 0
    seq: int = 0


def ask_for_model(bus: Bus, wish: Wish, timeout: float = PATIENCE) -> Granted:
    """Send the wish and wait for the answer.

    Raises:
        BusError: no monitor answers.
    """
    for reply in bus.query(KEY, msgspec.json.encode(wish), timeout):
        try:
            return msgspec.json.decode(reply, type=Granted)
        except msgspec.DecodeError:
            continue
    raise BusError(f"no monitor of rig {bus.rig} answers: start `rigwatch monitor`")
