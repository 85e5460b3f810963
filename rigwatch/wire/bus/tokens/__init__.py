"""Liveliness tokens with a name, at few keys: `said/monitor/3` is `<run>/<since>/<identity>`.

Zenoh keeps 2.4 kB for every key of a token that was ever declared, in the router and in clients, so
what differs from start to start must not be part of the key. The holder of a token sends its name
just before the token appears, and answers whoever asks for it later.
"""

from rigwatch.wire.bus.tokens.early_messages import EarlyMessages
from rigwatch.wire.bus.tokens.holding import SLOTS, NamedToken
from rigwatch.wire.bus.tokens.names import sender_named
from rigwatch.wire.bus.tokens.watching import Changed, NamedTokens

__all__ = [
    "SLOTS",
    "Changed",
    "EarlyMessages",
    "NamedToken",
    "NamedTokens",
    "sender_named",
]
