"""What is asked of the data acquisition of a rig about its device, and its reply."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeviceRequest:
    """A request to take another device for that of the rig.

    Attributes:
        identity: what this device tells of itself; another one that answers meanwhile is not meant.
        user: who makes the request.
        text: the reason.
        proof: the operator's signature, or without keys that of the account.
    """

    identity: str
    user: str
    text: str
    proof: str = ""


@dataclass(frozen=True, slots=True)
class DeviceReply:
    """What data acquisition answers.

    Attributes:
        done: whether the other device is taken from now on.
        text: why not, or since when.
        known: what the rig's device tells of itself; empty if it tells nothing, or none was met.
        refused: whether another device answers now, of which no sample is taken.
        answers: what that one tells of itself.
    """

    done: bool
    text: str
    known: str = ""
    refused: bool = False
    answers: str = ""
