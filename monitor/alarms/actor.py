"""Who or what changes an alarm."""

from dataclasses import dataclass

from rigwatch.wire.messages import Identity


@dataclass(frozen=True, slots=True)
class Actor:
    """Who or what caused a transition.

    Attributes:
        user: the operator, "" if nobody acted.
        identity: whether the operator is proved by a signature.
        text: the operator's remark, or the reason of the transition.
    """

    user: str = ""
    identity: Identity = ""
    text: str = ""


NOBODY = Actor()
