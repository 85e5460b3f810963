"""What is asked of a running monitor's model, and its reply."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class ModelRequest:
    """A model-change request.

    Attributes:
        action: "promote" this model, "rollback" to the previous version, or "accept" a wiring that
            does not pass.
        model: the model file's text; for "accept" the alarm's name; empty for a rollback.
        user: who makes the request.
        text: the reason.
        proof: the operator's signature, or without keys that of the account.
    """

    action: Literal["promote", "rollback", "accept"]
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
