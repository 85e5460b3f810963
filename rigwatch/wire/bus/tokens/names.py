"""The bytes that name a token, `<key> <name>`, as its holder sends them and answers with them.

Names of senders are `<number>/<start>/<identity>`: run or boot, Unix time [ns], and the holder.
"""

import contextlib

ASK_TIMEOUT = 0.5
"""Longest wait for the holders of tokens to say their names [s]."""
LONGEST_NAME = 256
"""Longest answer that is taken for a name [bytes]."""
NUMBERS = range(-(2**63), 2**63)
"""What a run or a boot can be: anybody may name a token, and a question to a ring holds 64 bits."""
Named = tuple[int, int, str]


def said(key: str, name: str) -> bytes:
    """The bytes that name a token."""
    return f"{key} {name}".encode()


def understood(answer: bytes) -> tuple[str, str] | None:
    """Key and name of a token; None if the bytes are none."""
    key, _, name = answer[: LONGEST_NAME + 1].decode(errors="replace").partition(" ")
    return (key, name) if name and len(answer) <= LONGEST_NAME else None


def sender_named(name: str | None) -> Named | None:
    """Run or boot, start [ns] and identity of a sender; None for a name of another form."""
    with contextlib.suppress(ValueError):
        number, since_ns, identity = (name or "").split("/")
        if int(number) in NUMBERS:
            return int(number), int(since_ns), identity
    return None
