"""The messages of a numbered topic, each once and in order; what is missing is fetched or counted.

    bus ──messages, tokens──▶ inbox ──▶ Speaker (one a process) ──▶ messages in order
                                ▲            │ Ask
                                └──replies── RingQuestions

After a link or a router was away, a speaker's token shows that it is back, and its ring is asked
for what it has said meanwhile. A message from one who does not own the run that he speaks for is
dropped and counted.
"""

import contextlib
import time
from collections import deque
from collections.abc import Mapping
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from rigwatch.wire.bus.message_ring import SAID_KEY, ring_key
from rigwatch.wire.bus.ring_questions import REPLY_TIMEOUT, RingQuestions
from rigwatch.wire.bus.speaker import Speaker
from rigwatch.wire.bus.subscription import QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.transport import MAX_PAYLOAD
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import EVENTS, GAPS, Event, Gap, Topic, decode
from rigwatch.wire.ordering import OPEN, Ask, Loss, Numbered, Outcome, Remark, RingReply

if TYPE_CHECKING:
    from rigwatch.wire.bus.bus import Bus

SILENCE = 0.5
"""Time without a message after which the rings are asked whether they have more [s]."""
MOST_SPEAKERS = 16
"""Processes that are listened to: more of them are none of ours."""
Place = tuple[int, int]


class CompleteSubscription(Subscription):
    """Messages of one numbered topic; not to be shared between threads.

    Args:
        bus: where they are said; `bus.process` is named in gaps.
        topic: a numbered topic.
        capacity: messages that wait before further ones are left to the ring.
        resume_after: run and number of the last message of each process that an earlier run of this
            listener has dealt with; else messages from now on.

    Attributes:
        lost: messages known to be gone.
        foreign: messages dropped because their sender does not own the run.
    """

    def __init__(
        self,
        bus: "Bus",
        topic: Topic,
        capacity: int = QUEUE_CAPACITY,
        resume_after: Mapping[str, Place] | None = None,
    ) -> None:
        super().__init__(topic, capacity)
        self.lost = self.foreign = 0
        self._bus = bus
        self._speakers: dict[str, Speaker] = {}
        self._runs: dict[int, str] = {}
        self._inbox: SimpleQueue[Any] = SimpleQueue()
        self._ready: deque[Any] = deque()
        self._reports: list[Gap | Event] = []
        self._looked_at = time.monotonic()
        self._questions = RingQuestions(bus, self._answered)
        self._start(dict(resume_after or {}))

    def _start(self, resume_after: dict[str, Place]) -> None:
        pattern = f"{SAID_KEY}/*/*/*/*"
        there = sorted(filter(None, map(_parsed, self._bus.tokens(pattern))), key=lambda t: t[2])
        for process, run, _, _ in there:
            resume_after.setdefault(process, (run, self._newest(process, run)))
        for process, place in resume_after.items():
            self._meet(process, place)
        for token in there:
            self._take_token(token, alive=True)
        for process, place in resume_after.items():
            # Taken for alive until the tokens that are there have been told.
            speaker = self._speakers[process]
            self._handle(process, speaker.vanished(place[0], 0))
        closers = [
            self._bus.watch_tokens(pattern, self._token),
            self._bus.transport.listen_from(self._bus.key(self.topic.key), self._receive),
        ]
        self._closers = [*closers, self._questions.close]

    def _newest(self, process: str, run: int) -> int:
        """Number of the last message that was said before anybody here listened."""
        ask = Ask(run, OPEN, OPEN)
        replies = self._bus.query(ring_key(process, self.topic), ask.to_bytes(), REPLY_TIMEOUT)
        return max((reply.settled for reply in _read(replies, run)), default=-1)

    def __len__(self) -> int:
        return self._inbox.qsize() + len(self._ready)

    def get(self, timeout: float | None = None) -> Any:
        """The next message, or None when none came within `timeout` [s].

        Args:
            timeout: 0 does not wait, None waits for ever.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._ready:
            left = SILENCE if deadline is None else min(SILENCE, deadline - time.monotonic())
            try:
                self._take(self._inbox.get(block=left > 0, timeout=max(left, 0.0)))
            except Empty:
                if left <= 0:
                    break
            self._look_for_more()
        return self._ready.popleft() if self._ready else None

    def drain(self) -> list[Any]:
        """All messages that wait now, in order."""
        for _ in range(self._inbox.qsize()):
            self._take(self._inbox.get_nowait())
        self._look_for_more()
        found = list(self._ready)
        self._ready.clear()
        return found

    def reports(self) -> list[Gap | Event]:
        """What this listener has published of its losses since the last call."""
        found, self._reports = self._reports, []
        return found

    def positions(self) -> dict[str, Place]:
        """Run and number of the last message of each process that is dealt with."""
        found = {name: speaker.order.position for name, speaker in self._speakers.items()}
        return {name: place for name, place in found.items() if place is not None}

    def close(self) -> None:
        """Receive no more."""
        for close in self._closers:
            close()

    # ---- called in the bus's threads ----------------------------------------------------

    def _receive(self, payload: bytes, sender: str, mark: bytes) -> None:
        if len(payload) > MAX_PAYLOAD:
            self.rejected += 1
        elif self._inbox.qsize() >= self._capacity:
            self.dropped += 1
        else:
            self._inbox.put((payload, sender, mark))

    def _token(self, key: str, alive: bool) -> None:
        if token := _parsed(key):
            self._inbox.put((token, alive))

    def _answered(self, key: str, ask: Ask, replies: list[bytes]) -> None:
        self._inbox.put((key.split("/")[1], ask, replies, None))

    # ---- called in the listener's thread ------------------------------------------------

    def _take(self, incoming: Any) -> None:
        if len(incoming) == 2:
            self._take_token(*incoming)
        elif len(incoming) == 3:
            self._take_message(*incoming)
        else:
            process, ask, replies, _ = incoming
            known = _read(replies, ask.boot)
            best = max(known, key=lambda reply: reply.settled, default=None)
            self._handle(process, self._speakers[process].replied(ask, best))

    def _take_token(self, token: "Token", alive: bool) -> None:
        process, run, since_ns, sender = token
        if process not in self._speakers and not (alive and self._meet(process, (run, -1))):
            return
        speaker = self._speakers[process]
        if alive:
            self._runs[run] = process
            self._handle(process, speaker.appeared(run, since_ns, sender))
        else:
            self._handle(process, speaker.vanished(run, since_ns))

    def _meet(self, process: str, place: Place) -> bool:
        """Listen to a further process, if it is not one too many."""
        if len(self._speakers) >= MOST_SPEAKERS:
            return False
        self._speakers[process] = Speaker(place)
        return True

    def _take_message(self, payload: bytes, sender: str, mark: bytes) -> None:
        try:
            message = Numbered.marked(mark, payload)
        except MessageError:
            self.rejected += 1
            return
        process = self._runs.get(message.boot, "")
        outcomes = self._speakers[process].said(message, sender) if process else None
        if outcomes is None:
            self.foreign += 1
        else:
            self._handle(process, outcomes)

    def _look_for_more(self) -> None:
        now = time.monotonic()
        if now - self._looked_at >= SILENCE:
            self._looked_at = now
            for process, speaker in self._speakers.items():
                self._handle(process, speaker.silent())

    def _handle(self, process: str, outcomes: list[Outcome[Numbered]]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Numbered):
                self._deliver(outcome)
            elif isinstance(outcome, Ask):
                self._questions.ask(ring_key(process, self.topic), outcome)
            elif isinstance(outcome, Loss):
                self._miss(process, outcome)
            elif outcome.severity == "error":
                self._remark(process, outcome)

    def _deliver(self, message: Numbered) -> None:
        self._looked_at = time.monotonic()
        try:
            self._ready.append(decode(self.topic.message, message.payload))
        except MessageError:
            self.rejected += 1

    def _miss(self, process: str, loss: Loss) -> None:
        self.lost += max(0, loss.last - loss.first + 1)
        gap = Gap(
            process, loss.boot, loss.first, loss.last, time.time_ns(),
            self._bus.process, loss.reason, self.topic.name,
        )  # fmt: skip
        self._reports.append(gap)
        self._bus.publish(GAPS, gap)

    def _remark(self, process: str, remark: Remark) -> None:
        text = f"{self.topic.name} of {process}: {remark.text}"
        event = Event(self._bus.process, time.time_ns(), remark.severity, remark.code, text)
        self._reports.append(event)
        self._bus.publish(EVENTS, event)


Token = tuple[str, int, int, str]


def _parsed(key: str) -> Token | None:
    """Process, run, since when and identity of a token; None for one that is none of ours."""
    with contextlib.suppress(ValueError):
        _, process, run, since_ns, sender = key.split("/")
        return process, int(run), int(since_ns), sender
    return None


def _read(replies: list[bytes], run: int) -> list[RingReply[Numbered]]:
    found = []
    for data in replies:
        with contextlib.suppress(MessageError):
            found.append(RingReply.of_messages(data))
    return [reply for reply in found if reply.boot == run]
