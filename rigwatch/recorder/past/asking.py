"""Fetches spans of a site's recordings in a separate thread, so that recording never waits."""

import contextlib
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import Queue, SimpleQueue

from msgspec import structs

from rigwatch.recorder.past.pages import Page, Question
from rigwatch.wire.bus import Bus
from rigwatch.wire.errors import BusError, MessageError
from rigwatch.wire.messages import PAST_KEY
from rigwatch.wire.session import Part

REPLY_TIMEOUT = 5.0
"""Longest time for a page [s]."""
PAUSE = 0.25
"""Time between two attempts [s]; one fails as well if answers are ahead of the sender's rate."""
PATIENCE = 60.0
"""Time without a page, while the site can be reached, after which an answer is given up [s]."""
MOST_PAGES = 8
"""Pages that wait for their reader."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A part of an answer.

    Attributes:
        name: name of the question.
        parts: messages.
        ended: whether it is the last one.
        complete: whether the recordings were read to the end of the span.
    """

    name: str
    parts: tuple[Part, ...]
    ended: bool = False
    complete: bool = False


class PastQuestions:
    """The questions of one recorder, answered one after the other.

    Args:
        bus: on which the site's recorder answers.
        reachable: whether any process of the site is there.
    """

    def __init__(self, bus: Bus, reachable: Callable[[], bool]) -> None:
        self._answers: Queue[Answer] = Queue(MOST_PAGES)
        self._bus, self._reachable = bus, reachable
        self._questions: SimpleQueue[tuple[str, Question] | None] = SimpleQueue()
        self._closed = threading.Event()
        self._name = secrets.token_hex(8)
        self._thread = threading.Thread(target=self._work, name="past-questions", daemon=True)
        self._left = bus.at_close(self.close)
        self._thread.start()

    def ask(self, name: str, question: Question) -> None:
        """Ask; the parts of the answer have this name."""
        self._questions.put((name, question))

    def taken(self) -> list[Answer]:
        """The parts of answers that have come."""
        return [self._answers.get_nowait() for _ in range(self._answers.qsize())]

    def close(self) -> None:
        """Stop asking, and wait for the thread to leave the bus."""
        self._closed.set()
        self._questions.put(None)
        while self._thread.is_alive() and threading.current_thread() is not self._thread:
            self.taken()
            self._thread.join(0.05)

    def _work(self) -> None:
        while (asked := self._questions.get()) is not None and not self._closed.is_set():
            self._fetch(*asked)
        with contextlib.suppress(ValueError):
            self._left()

    def _fetch(self, name: str, question: Question) -> None:
        heard_at = time.monotonic()
        question = structs.replace(question, asker=self._name)
        while not self._closed.is_set():
            page = self._page(question)
            # The last page may lack what is not on the disk yet.
            if page is not None and (page.bookmark or page.settled >= question.end):
                heard_at = time.monotonic()
                ended = page.bookmark is None
                self._answers.put(Answer(name, page.parts, ended, complete=ended))
                if ended:
                    return
                question = structs.replace(question, bookmark=page.bookmark)
                continue
            if not self._reachable():
                heard_at = time.monotonic()
            if time.monotonic() - heard_at > PATIENCE:
                self._answers.put(Answer(name, (), ended=True))
                return
            self._closed.wait(PAUSE)

    def _page(self, question: Question) -> Page | None:
        with contextlib.suppress(BusError, MessageError):
            for data in self._bus.query(PAST_KEY, question.to_bytes(), REPLY_TIMEOUT):
                return Page.from_bytes(data)
        return None
