"""Refuses a command that was signed for another run or executed before, in bounded memory."""

import heapq
import secrets
import threading

from rigwatch.wire.access.statement import Proof
from rigwatch.wire.errors import KeysError

KEPT = 256
"""Number of nonces stored per signer."""


class CommandRun:
    """One run of a process that receives commands.

    Attributes:
        run: its random identity, which a command must name.
    """

    def __init__(self) -> None:
        self.run = secrets.token_hex(16)
        self._replays: dict[str, Replays] = {}
        self._lock = threading.Lock()

    def check(self, proof: Proof, signer: str = "") -> None:
        """Refuse what is not for this run, or was received before; store it as received.

        Args:
            proof: with a signature that was verified.
            signer: common name of the certificate, "" without keys.

        Raises:
            KeysError: why it is refused.
        """
        if self.run not in proof.runs:
            raise KeysError("it is signed for another run of this process")
        with self._lock:
            seen = self._replays.setdefault(signer, Replays())
            if not seen.is_new(proof.nonce, proof.t_ns):
                raise KeysError("it was received before")


class Replays:
    """The nonces of one signer's commands in one run.

    When more than `KEPT` are stored, those with the earliest time of signing are dropped, and
    commands signed no later than a dropped one are refused.
    """

    def __init__(self) -> None:
        self._nonces: set[str] = set()
        self._by_time: list[tuple[int, str]] = []
        self._dropped_ns = -(1 << 63)

    def is_new(self, nonce: str, t_ns: int) -> bool:
        """Whether the command was not seen before; it is stored as seen.

        Args:
            nonce: of the command.
            t_ns: time of signing [ns].
        """
        if nonce in self._nonces or t_ns <= self._dropped_ns:
            return False
        self._nonces.add(nonce)
        heapq.heappush(self._by_time, (t_ns, nonce))
        if len(self._by_time) > KEPT:
            self._dropped_ns, dropped = heapq.heappop(self._by_time)
            self._nonces.discard(dropped)
        return True
