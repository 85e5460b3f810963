"""The bytes that name a token, `<key> <name>`, as its holder sends them and answers with them."""

ASK_TIMEOUT = 0.5
"""Longest wait for the holders of tokens to say their names [s]."""
LONGEST_NAME = 256
"""Longest answer that is taken for a name [bytes]."""


def said(key: str, name: str) -> bytes:
    """The bytes that name a token."""
    return f"{key} {name}".encode()


def understood(answer: bytes) -> tuple[str, str] | None:
    """Key and name of a token; None if the bytes are none."""
    key, _, name = answer[: LONGEST_NAME + 1].decode(errors="replace").partition(" ")
    return (key, name) if name and len(answer) <= LONGEST_NAME else None
