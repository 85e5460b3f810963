"""The messages of a numbered topic, each once and in order; missing ones are fetched or counted.

    bus ──messages, tokens──▶ inbox ──▶ Sender (one per process) ──▶ messages in order
                                ▲            │ Ask
                                └──replies── RingQuestions

After an interruption of the link or router, the sender's liveliness token shows that it is back,
and its ring is queried for the messages sent meanwhile. A message from a process that does not own
the run it names is dropped and counted.
"""

import contextlib
import time
from collections import deque
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from rigwatch.wire.access import alarm_roles
from rigwatch.wire.bus.alarms import AlarmShares, Retold
from rigwatch.wire.bus.inbox import Inbox
from rigwatch.wire.bus.member import Member
from rigwatch.wire.bus.message_ring import SAID_KEY, ring_key
from rigwatch.wire.bus.ring_questions import REPLY_TIMEOUT, RingQuestions
from rigwatch.wire.bus.sender import Sender
from rigwatch.wire.bus.several import JointReceiver, Share, Source
from rigwatch.wire.bus.subscription import QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.tokens import EarlyMessages, sender_named
from rigwatch.wire.bus.transport import MAX_PAYLOAD
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import ALARMS, EVENTS, GAPS, Event, Gap, Topic, decode, decode_all
from rigwatch.wire.ordering import (
    OPEN,
    Ask,
    Loss,
    Numbered,
    NumberedRun,
    Outcome,
    Remark,
    RingReply,
)

SILENCE = 0.5
"""Time without a message after which the rings are queried for more [s]."""
LONGEST_SILENCE = 16.0
"""The same for a patient reader, whose queries are the rarer the longer nothing comes: what a rig
rarely says would otherwise be asked for all the time, and each query wakes three processes [s]."""
MOST_SENDERS = 16
"""Largest number of senders followed; a rig has fewer, so further ones are ignored."""
RUN_KEPT = 600.0
"""Time for which a run that has ended is remembered: nothing of it is on the way after that [s]."""
Place = tuple[int, int]


class CompleteSubscription(Subscription):
    """Messages of one numbered topic; not thread-safe.

    Args:
        bus: source of the messages; `bus.process` is named in gaps.
        topic: a numbered topic.
        capacity: messages queued before further ones are left to the ring.
        resume_after: run and number of the last message of each process that an earlier run of this
            subscriber has processed; a process that is not among them has begun since, and is
            followed from its first message on. None for messages from now on.
        gaps_in_place: losses are returned among the messages, in their place, not by `reports`.
        publish_gaps: whether losses are published and counted; not if they may still be filled.
        patient: see `SampleOrder`; and rings are queried less often while nothing comes.

    Attributes:
        lost: messages known to be lost.
        foreign: messages dropped because their sender does not own the run, or has said too many
            different alarms.
    """

    def __init__(
        self,
        bus: Member,
        topic: Topic,
        capacity: int = QUEUE_CAPACITY,
        resume_after: Mapping[str, Place] | None = None,
        *,
        gaps_in_place: bool = False,
        publish_gaps: bool = True,
        patient: bool = False,
    ) -> None:
        super().__init__(topic, capacity)
        self.lost = self.foreign = 0
        self._bus, self._patient = bus, patient
        self._gaps_in_place, self._publish_gaps = gaps_in_place, publish_gaps
        self._senders: dict[str, Sender] = {}
        self._runs: dict[int, list[str]] = {}
        self._ended: dict[tuple[int, str], float] = {}
        self._assumed: dict[str, int] = {}
        self._unconfirmed: dict[str, list[Token]] = {}
        self._awaited: dict[str, list[tuple[Token, bool]]] = {}
        self._early = EarlyMessages()
        self._inbox: Inbox[Any] = Inbox(capacity)
        self._ready: deque[bytes | Gap] = deque()  # decoded by the call that returns them
        self._reports: list[Gap | Event] = []
        self._behind = False
        # The earlier run knew every process of its time.
        self._began_ns = time.time_ns() if resume_after is None else 0
        self._looked_at, self._silence = time.monotonic(), SILENCE
        self._shares = AlarmShares() if topic is ALARMS else None
        self._retold = Retold() if topic is ALARMS else None
        self._questions = RingQuestions(bus, self._answered)
        self._start(dict(resume_after or {}))

    def _start(self, resume_after: dict[str, Place]) -> None:
        places = f"{SAID_KEY}/*"
        found = [_parsed(*one) for one in self._bus.names(places)]
        unnamed = {process for process, token in found if token is None}
        there = sorted((token for _, token in found if token), key=lambda token: token[2])
        for process, run, since_ns, _ in there:
            if process not in resume_after:
                last = self._newest(process, run) if since_ns < self._began_ns else -1
                resume_after[process] = run, last
        for process, place in resume_after.items():
            self._follow(process, place)
        for token in there:
            self._take_token(token, alive=True)
            # One that ends before it is watched by its name ends without it.
            self._unconfirmed.setdefault(token[0], []).append(token)
        for process, place in resume_after.items():
            # Assumed alive until the names of the existing tokens are known.
            self._assumed[process] = place[0]
            if process not in unnamed:
                self._end_assumed(process)
        closers = [
            self._bus.watch_names(places, self._token),
            self._inbox.follow(self._bus, self.topic, self._receive),
        ]
        self._closers = [*closers, self._questions.close]

    def _newest(self, process: str, run: int) -> int:
        """Number of the last message sent before this subscription began."""
        ask = Ask(run, OPEN, OPEN)
        replies = self._bus.query(ring_key(process, self.topic), ask.to_bytes(), REPLY_TIMEOUT)
        return max((reply.settled for reply in _read(replies, run)), default=-1)

    def __len__(self) -> int:
        return len(self._inbox) + len(self._ready)

    def get(self, timeout: float | None = None) -> Any:
        """The next message, or None if none arrives within `timeout` [s].

        Args:
            timeout: 0 does not wait, None waits indefinitely.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._wait(deadline)
            if not self._ready:
                return None
            if found := self._decoded([self._ready.popleft()]):
                return found[0]

    def _wait(self, deadline: float | None) -> None:
        """Wait for a message until `deadline` [s on the monotonic clock]."""
        while not self._ready:
            left = SILENCE if deadline is None else min(SILENCE, deadline - time.monotonic())
            if not self._took(left) and left <= 0:
                return
            self._look_for_more()

    def drain(self, most: int | None = None) -> list[Any]:
        """The waiting messages, in order; `most` of them, or all."""
        return self._decoded(self._drained(most))

    def _drained(self, most: int | None = None) -> list[bytes | Gap]:
        self._took(0.0)
        self._look_for_more()
        count = len(self._ready) if most is None else min(most, len(self._ready))
        return [self._ready.popleft() for _ in range(count)]

    def catch_up(self, longest: float) -> list[Any]:
        """The waiting messages, and those of the rings as long as each answer brings more.

        Blocks of estimates are joined where one continues another.

        Args:
            longest: time after which the rest is left to the next call [s].
        """
        until = time.monotonic() + longest
        found = self._drained()
        while self._behind and (left := until - time.monotonic()) > 0:
            self._took(left)
            found += self._drained()
        return self._joined(found)

    def _decoded(self, waiting: Sequence[bytes | Gap]) -> list[Any]:
        """The messages that are valid."""
        found = []
        for one in waiting:
            try:
                found.append(one if isinstance(one, Gap) else decode(self.topic.message, one))
            except MessageError:
                self.rejected += 1
        return found

    def _joined(self, waiting: Sequence[bytes | Gap]) -> list[Any]:
        """The same with joined blocks; none across a gap."""
        found: list[Any] = []
        for is_gap, some in groupby(waiting, lambda one: isinstance(one, Gap)):
            if is_gap:
                found += some
                continue
            messages, rejected = decode_all(self.topic.message, [*some])  # type: ignore[list-item]
            self.rejected += rejected
            found += messages
        return found

    @property
    def joint(self) -> JointReceiver | None:
        """What receives the messages of this rig among those of others; None if nothing does."""
        return self._inbox.outside.of if isinstance(self._inbox.outside, Share) else None

    def may_hold(self) -> bool:
        """Whether something may wait: a look that costs less than the number of messages."""
        return bool(self._ready or self._reports) or self._inbox.may_hold()

    def open_row(self, device: str, boot: int, following: int) -> bool:
        """Leave blocks that simply follow to the row of this rig, if it can have one.

        That is until `close_row` is called, or something else comes. What the row has taken is told
        by `went_on`, before anything is read here again.

        Args:
            device, boot: of the last block.
            following: number of the sample after it.
        """
        outside, going = self._inbox.outside, self._going_on()
        if not isinstance(outside, Share) or going is None or self.may_hold():
            return False
        run, number, sender = going
        source = Source(sender, device, boot, lambda _: True)
        message = run, number + 1
        return outside.of.open(outside, source, following, self._inbox.is_read, message)

    def _going_on(self) -> tuple[int, int, str] | None:
        """Run, number and sender of the last message, if one process alone has ever sent any."""
        if self._shares is not None or len(self._senders) != 1:
            return None
        ((process, peer),) = self._senders.items()
        going = peer.going_on
        return going if going and self._runs.get(going[0]) == [process] else None

    def close_row(self) -> None:
        """Read all that comes here again."""
        self._inbox.keep_order()

    def went_on(self, count: int) -> None:
        """The row has taken so many messages since it was opened, or since that was told before."""
        if count:
            (peer,) = self._senders.values()
            peer.went_on(count)
            self._heard()

    def reports(self) -> list[Gap | Event]:
        """Reports of losses that this subscriber has published since the last call."""
        found, self._reports = self._reports, []
        return found

    def positions(self) -> dict[str, Place]:
        """Run and number of the last processed message of each process."""
        found = {name: peer.order.position for name, peer in self._senders.items()}
        return {name: place for name, place in found.items() if place is not None}

    def is_process(self, process: str, sender: str) -> bool:
        """Whether the identity `sender` is that of a process that is followed."""
        peer = self._senders.get(process)
        return peer is not None and peer.is_owner(sender)

    def close(self) -> None:
        """Stop receiving."""
        for close in self._closers:
            close()

    # ---- called in the bus's threads ----------------------------------------------------

    def _receive(self, payload: bytes, sender: str, mark: bytes) -> None:
        if len(payload) > MAX_PAYLOAD:
            self.rejected += 1
        elif not self._inbox.accept((payload, sender, mark)):
            self.dropped += 1

    def _token(self, place: str, name: str | None, alive: bool) -> None:
        self._inbox.put((*_parsed(place, name), alive, name is not None))

    def _answered(self, key: str, ask: Ask, replies: list[bytes]) -> None:
        self._inbox.put((key.split("/")[1], ask, replies, None))

    # ---- called in the subscriber's thread ----------------------------------------------

    def _took(self, timeout: float) -> bool:
        """Take what waits, after up to `timeout` [s] for the first; whether there was any."""
        waiting = self._inbox.take(timeout)
        if not self._took_run(waiting):
            for incoming in waiting:
                self._take(incoming)
        return bool(waiting)

    def _took_run(self, waiting: Sequence[Any]) -> bool:
        """Take all if they are messages of one run that simply follow, as nearly always.

        What `_take` does with each of them, in a small part of its time. Alarms are looked into.
        """
        if len(waiting) < 2 or self._shares is not None or any(len(one) != 3 for one in waiting):
            return False
        payloads, senders, marks = zip(*waiting, strict=True)
        run = NumberedRun.marked(marks, payloads)
        names = self._runs.get(run.boot, ()) if run and len({*senders}) == 1 else ()
        peer = self._senders.get(names[0]) if len(names) == 1 else None
        if run is None or peer is None or not peer.goes_on(run, senders[0]):
            return False
        self._heard()
        self._ready += payloads
        return True

    def _take(self, incoming: Any) -> None:
        if isinstance(incoming[2], bool):
            self._take_name(*incoming)
        elif isinstance(incoming[0], bytes):
            self._take_message(*incoming)
        else:
            process, ask, replies, _ = incoming
            known = _read(replies, ask.boot)
            best = max(known, key=lambda reply: reply.settled, default=None)
            if process in self._awaited:
                self._follow_awaited(process, best)
                return
            outcomes = self._senders[process].replied(ask, best)
            self._behind = {Numbered, Ask} <= set(map(type, outcomes))
            self._handle(process, outcomes)

    def _take_name(self, process: str, token: "Token | None", alive: bool, named: bool) -> None:
        self._early.token(process, named=named, alive=alive)
        if token is not None:
            self._unconfirmed.pop(process, None)
            self._take_token(token, alive)
        elif not alive:
            for ended in self._unconfirmed.pop(process, ()):
                self._take_token(ended, alive=False)
        if named or not alive:
            self._end_assumed(process)
            self._take_early()

    def _end_assumed(self, process: str) -> None:
        run = self._assumed.pop(process, None)
        if run is not None:
            self._handle(process, self._senders[process].vanished(run, 0))

    def _take_early(self) -> None:
        for message, sender in self._early.taken():
            self._take_numbered(message, sender)
        self._early.settle()

    def _take_token(self, token: "Token", alive: bool) -> None:
        process, run, since_ns, sender = token
        if process in self._awaited:
            self._awaited[process].append((token, alive))
            return
        if process not in self._senders and not (alive and self._follow_new(token)):
            return
        peer = self._senders[process]
        if alive:
            self._begin_run(run, process)
            self._handle(process, peer.appeared(run, since_ns, sender))
        else:
            self._end_run(run, process)
            self._handle(process, peer.vanished(run, since_ns))

    def _begin_run(self, run: int, process: str) -> None:
        """Note that a process calls a run its own; others may do so too, as runs are no secret."""
        self._ended.pop((run, process), None)
        if process not in (names := self._runs.setdefault(run, [])):
            names.append(process)

    def _end_run(self, run: int, process: str) -> None:
        """Note the end of a run, and forget those that ended long ago."""
        now = time.monotonic()
        if process in self._runs.get(run, ()):
            self._ended.pop((run, process), None)
            self._ended[run, process] = now
        for gone, of in [one for one, at in self._ended.items() if now - at >= RUN_KEPT]:
            del self._ended[gone, of]
            self._runs[gone].remove(of)
            if not self._runs[gone]:
                del self._runs[gone]

    def _follow_new(self, token: "Token") -> bool:
        """Follow a process whose token was not seen at the start; an older run from now on.

        False if it is not followed, or not yet: where an older run is, its ring has to say.
        """
        process, run, since_ns, _ = token
        if since_ns >= self._began_ns:
            return self._follow(process, (run, -1))
        early = self._early.first_of(run)
        if early is not None:
            return self._follow(process, (run, early - 1))
        if self._has_room_for(process):
            # Whoever reads here, perhaps for many rigs in turns, does not wait for an answer.
            self._awaited[process] = [(token, True)]
            self._early.token(process, named=False, alive=True)
            self._questions.ask(ring_key(process, self.topic), Ask(run, OPEN, OPEN))
        return False

    def _follow_awaited(self, process: str, newest: RingReply[Numbered] | None) -> None:
        """The ring of a process has said what its newest message is, or has not answered."""
        tokens = self._awaited.pop(process)
        self._early.token(process, named=True, alive=True)
        run = tokens[0][0][1]
        early = self._early.first_of(run)
        gone = not all(alive for _, alive in tokens)
        if early is not None or newest is not None or not gone:  # else nothing was ever heard of it
            last = early - 1 if early is not None else newest.settled if newest is not None else -1
            self._follow(process, (run, last))
            for token, alive in tokens:
                self._take_token(token, alive)
        self._take_early()

    def _has_room_for(self, process: str) -> bool:
        # Strangers that come first leave room for those who say alarms.
        followed = len(self._senders) + len(self._awaited)
        return followed < MOST_SENDERS or process in alarm_roles()

    def _follow(self, process: str, place: Place) -> bool:
        """Follow a further process, unless the limit is reached."""
        if not self._has_room_for(process):
            return False
        self._senders[process] = Sender(place, patient=self._patient)
        return True

    def _take_message(self, payload: bytes, sender: str, mark: bytes) -> None:
        try:
            message = Numbered.marked(mark, payload)
        except MessageError:
            self.rejected += 1
            return
        self._take_numbered(message, sender)

    def _take_numbered(self, message: Numbered, sender: str) -> None:
        names = self._runs.get(message.boot, ())
        if not names and self._early.keep(message, sender):
            return
        for process in names:
            peer = self._senders.get(process)
            outcomes = peer.received(message, sender) if peer else None
            if outcomes is not None:
                self._handle(process, outcomes)
                return
        if not names and self._early.ended:
            self._miss_unknown(message)
        else:
            self.foreign += 1

    def _miss_unknown(self, message: Numbered) -> None:
        """A process has ended before its name was known, perhaps the one that sent the message."""
        first, process = message.seq, self._early.ended
        reason = "the process ended before it could say who it was"
        self._begin_run(message.boot, process)
        self._end_run(message.boot, process)
        self._miss(process, Loss(message.boot, first, first - 1, reason))

    def _look_for_more(self) -> None:
        now = time.monotonic()
        if now - self._looked_at >= self._silence:
            self._looked_at = now
            if self._patient:
                self._silence = min(2.0 * self._silence, LONGEST_SILENCE)
            for process, peer in self._senders.items():
                self._handle(process, peer.silent())

    def _handle(self, process: str, outcomes: list[Outcome[Numbered]]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Numbered):
                self._deliver(process, outcome)
            elif isinstance(outcome, Ask):
                self._questions.ask(ring_key(process, self.topic), outcome)
            elif isinstance(outcome, Loss):
                self._miss(process, outcome)
            elif outcome.severity == "error":
                self._remark(process, outcome)

    def _heard(self) -> None:
        """The next look for more is after a short silence."""
        self._looked_at, self._silence = time.monotonic(), SILENCE

    def _deliver(self, process: str, message: Numbered) -> None:
        self._heard()
        if self._shares is None or self._shares.admits(process, message.payload):
            if self._retold is None or not self._retold.is_repeat(process, message):
                self._ready.append(message.payload)
            return
        if self._shares.is_first_refusal(process):
            text = f"{process} has said more alarms than a rig has; further ones are dropped"
            self._remark(process, Remark("error", "ALARMS REFUSED", text))
        self.foreign += 1

    def _miss(self, process: str, loss: Loss) -> None:
        gap = Gap(
            process, loss.boot, loss.first, loss.last, time.time_ns(),
            self._bus.process, loss.reason, self.topic.name,
        )  # fmt: skip
        if self._gaps_in_place:
            self._ready.append(gap)
        else:
            self._reports.append(gap)
        if self._publish_gaps:
            self.lost += max(0, loss.last - loss.first + 1)
            self._bus.publish(GAPS, gap)

    def _remark(self, process: str, remark: Remark) -> None:
        text = f"{self.topic.name} of {process}: {remark.text}"
        event = Event(self._bus.process, time.time_ns(), remark.severity, remark.code, text)
        self._reports.append(event)
        self._bus.publish(EVENTS, event)


Token = tuple[str, int, int, str]


def _parsed(place: str, name: str | None) -> tuple[str, Token | None]:
    """Process, and its token with run, start time and identity; None if it is not of this form."""
    process, named = place.rpartition("/")[2], sender_named(name)
    return process, None if named is None else (process, *named)


def _read(replies: list[bytes], run: int) -> list[RingReply[Numbered]]:
    found = []
    for data in replies:
        with contextlib.suppress(MessageError):
            found.append(RingReply.of_messages(data))
    return [reply for reply in found if reply.boot == run]
