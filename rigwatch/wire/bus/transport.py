"""What carries the bytes between processes, whatever is beneath: Zenoh, or memory in tests."""

from collections.abc import Callable
from typing import Protocol

MAX_PAYLOAD = 1 << 18
"""Largest payload that any of our messages or replies has [bytes]; larger ones are refused."""

Close = Callable[[], None]
Receive = Callable[[bytes, str, bytes], None]
"""Given a payload, the identity of its sender and the mark that came with it."""
Answer = Callable[[bytes], list[bytes]]
"""Given a question's bytes, the replies' bytes, none of them above `MAX_PAYLOAD`."""


class Transport(Protocol):
    """What carries bytes between processes. Keys are whole, such as "rig/bench1/daq/samples"."""

    @property
    def identity(self) -> str:
        """Who this process is to those that hear it; no two on a bus are the same."""

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send without waiting, `mark` beside it; dropped where the link is full or down."""

    def listen(self, key: str, receive: Callable[[bytes], None]) -> Close:
        """Call `receive` with each payload put to `key`, in the transport's own thread."""

    def listen_from(self, key: str, receive: Receive) -> Close:
        """The same with the sender's `identity`, "" where nobody says it, and the mark."""

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer questions to `key`, in a thread of the transport."""

    def ask(self, key: str, question: bytes, timeout: float) -> list[bytes]:
        """The replies of all that serve `key`, as many as came within `timeout` [s]."""

    def declare_token(self, key: str) -> Close:
        """Show a token at `key` that vanishes when closed or when this process dies."""

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Keys of the tokens that are alive now and match `pattern` (`*`: one part of a key)."""

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)` for tokens that match, first for those there already."""

    def connected(self) -> bool:
        """Whether there is a link to the router now."""

    def close(self) -> None:
        """Close everything that was opened through this transport."""


def answered(answer: Answer, question: bytes) -> list[bytes]:
    """The replies to a question; none where the one who answers fails or says too much."""
    try:
        return [reply for reply in answer(question) if len(reply) <= MAX_PAYLOAD]
    except Exception:
        # A question comes from outside: it must not end the thread that serves.
        return []
