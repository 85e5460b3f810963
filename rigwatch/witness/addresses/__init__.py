"""How a recipient is reached, by an address or a command, each time with a time limit."""

from rigwatch.witness.addresses.bounded import Bounded
from rigwatch.witness.addresses.http_ping import why_not
from rigwatch.witness.addresses.senders import Sender, sender_of

__all__ = ["Bounded", "Sender", "sender_of", "why_not"]
