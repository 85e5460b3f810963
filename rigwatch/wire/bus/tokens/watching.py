"""Watches tokens with names.

Zenoh ──token appears──▶ NamedTokens ──its name, as soon as it is known──▶ watchers
holder ──name───────────────▲  │ question, in a thread
       ◀────────────────────┴──┘
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue

from rigwatch.wire.bus.tokens.names import ASK_TIMEOUT, understood
from rigwatch.wire.bus.transport import Close, Transport

Changed = Callable[[str, str | None, bool], None]
"""Called with a place, a name, and whether a token with it is there:

    place, None, True     a token has appeared, its name is not known yet
    place, name, True     its name
    place, name, False    it has vanished
    place, None, False    it has vanished before its name was known
"""
END_TIMEOUT = 2.0
PAUSES = (0.02, 0.05, 0.1, 0.2, 0.4)
"""Delays before an unanswered question is repeated [s]."""
MOST_TOLD = 1024
"""Names kept for tokens that have not appeared yet."""


@dataclass
class _Token:
    """A token that is there.

    Attributes:
        name: None while it is not known.
        due: when its holder is asked next [s, monotonic], None if it has answered.
        asked: number of unanswered questions.
    """

    name: str | None = None
    due: float | None = 0.0
    asked: int = 0


@dataclass
class _Watch:
    """One pattern of places, and what is there."""

    changed: Changed
    tokens: dict[str, _Token] = field(default_factory=dict)
    told: dict[str, str] = field(default_factory=dict)
    """Names that were sent and whose token has not appeared yet."""
    lock: threading.RLock = field(default_factory=threading.RLock)


class NamedTokens:
    """The tokens with names that one process watches, at complete keys `<place>/<slot>`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._watches: list[_Watch] = []
        self._wake: SimpleQueue[bool] = SimpleQueue()
        self._thread: threading.Thread | None = None

    def names(self, places: str, timeout: float) -> list[tuple[str, str | None]]:
        """Place and name of each token there is; None for the name that nobody answers with."""
        keys = self._transport.tokens(f"{places}/*", timeout)
        answers = self._transport.ask(f"{places}/*", b"", ASK_TIMEOUT) if keys else []
        found = dict(filter(None, map(understood, answers)))
        return [(_place(key), found.get(key)) for key in keys]

    def holders(self, place: str) -> set[str]:
        """The names of all that hold a token at a place, also of several at one key."""
        answers = self._transport.ask(f"{place}/*", b"", ASK_TIMEOUT)
        found = filter(None, map(understood, answers))
        return {name for key, name in found if _place(key) == place}

    def watch(self, places: str, changed: Changed) -> Close:
        """Follow the tokens of all places that match, first those that are there.

        `changed` is called in threads of the bus.
        """
        watch = _Watch(changed)
        self._watches.append(watch)
        closers = [
            self._transport.listen_from(
                f"{places}/*", lambda payload, sender, _: self._hear(watch, payload, sender)
            ),
            self._transport.watch_tokens(
                f"{places}/*", lambda key, alive: self._change(watch, key, alive)
            ),
        ]

        def close() -> None:
            for one in closers:
                one()
            self._watches.remove(watch)

        return close

    def close(self) -> None:
        """End the thread, if there is one."""
        # If the interpreter ends while a thread waits in Zenoh, the process aborts (CPython 87135).
        if self._thread is not None:
            self._wake.put(False)
            self._thread.join(END_TIMEOUT)

    # ---- called in the bus's threads ----------------------------------------------------

    def _hear(self, watch: _Watch, payload: bytes, sender: str) -> None:
        """A holder names its token, which appears at about the same time; only for itself."""
        key, name = understood(payload) or ("", "")
        if name.rpartition("/")[2] != sender:
            return
        with watch.lock:
            token = watch.tokens.get(key)
            if token is not None and token.name in (None, name):
                self._name(watch, key, token, name)
            elif len(watch.told) < MOST_TOLD or key in watch.told:
                watch.told[key] = name

    def _change(self, watch: _Watch, key: str, alive: bool) -> None:
        with watch.lock:
            if alive:
                self._appear(watch, key)
            elif token := watch.tokens.pop(key, None):
                watch.changed(_place(key), token.name, False)

    def _appear(self, watch: _Watch, key: str) -> None:
        told = watch.told.pop(key, None)
        token = watch.tokens.setdefault(key, _Token())
        token.due, token.asked = 0.0, 0
        watch.changed(_place(key), None, True)
        if told is not None and told != token.name:
            self._name(watch, key, token, told)
        elif token.name is not None:
            watch.changed(_place(key), token.name, True)
        self._start()
        self._wake.put(True)

    def _name(self, watch: _Watch, key: str, token: _Token, name: str) -> None:
        if token.name == name:
            return
        if token.name is not None:
            watch.changed(_place(key), token.name, False)
        token.name = name
        watch.changed(_place(key), name, True)

    # ---- asking -------------------------------------------------------------------------

    def _start(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="token-names", daemon=True)
            self._thread.start()

    def _work(self) -> None:
        going = True
        while going:
            wait = self._ask_due()
            try:
                going = self._wake.get(timeout=wait)
            except Empty:
                continue

    def _ask_due(self) -> float | None:
        """Ask each holder that is due; time until the next one is [s]."""
        for watch in tuple(self._watches):
            for key, token in tuple(watch.tokens.items()):
                if token.due is not None and time.monotonic() >= token.due:
                    self._ask(watch, key, token)
        found = [
            token.due
            for watch in tuple(self._watches)
            for token in tuple(watch.tokens.values())
            if token.due is not None
        ]
        return max(0.0, min(found) - time.monotonic()) if found else None

    def _ask(self, watch: _Watch, key: str, token: _Token) -> None:
        answers = map(understood, self._transport.ask(key, b"", ASK_TIMEOUT))
        names = [name for at, name in filter(None, answers) if at == key]
        with watch.lock:
            if watch.tokens.get(key) is not token:
                return
            if not names:
                pause = PAUSES[min(token.asked, len(PAUSES) - 1)]
                token.due, token.asked = time.monotonic() + pause, token.asked + 1
                return
            token.due = None
            if token.name not in names:
                # Another process has taken the place since.
                self._name(watch, key, token, names[0])


def _place(key: str) -> str:
    return key.rpartition("/")[0]
