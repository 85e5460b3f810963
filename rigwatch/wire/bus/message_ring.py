"""Recent messages of a process, numbered and stored for subscribers that missed some.

Every message of a numbered topic is stored in the ring before it is published, with the run of its
process (a random number drawn at the start) and its number within the run. A liveliness token at
`said/<process>`, named `<run>/<since>/<identity>`, identifies the sender; queries to
`ring/<process>/<topic>` return stored messages, of alarms also those of earlier runs if they are
kept in a file (`kept_messages.py`).
"""

import secrets
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, starmap

import zstandard

from rigwatch.wire.bus.kept_messages import KeptMessages
from rigwatch.wire.bus.slabs import Slabs
from rigwatch.wire.bus.tokens import NamedToken
from rigwatch.wire.bus.transport import MAX_PAYLOAD, Answer, Transport, send
from rigwatch.wire.messages import ALARMS, TOPICS, Topic, bus_key
from rigwatch.wire.ordering import UNKNOWN, Ask, Numbered, PastRuns, RingReply, first_fitting

SAID_KEY = "said"
RING_BYTES, RARE_BYTES = 32 << 20, 2 << 20
"""Capacity per topic [bytes]: two minutes of estimates; of topics whose messages come now and then
at most the second, months of alarms, which fills within days where many are raised: a ring that
fills for a year takes memory for a year.
"""
PACKED, PACK_LEVEL = 64, 1
"""Messages that are compressed together, and zstd's level: half a millisecond each second."""
_LENGTH = struct.Struct("<I")
REPLY_BYTES = MAX_PAYLOAD // 2
LARGEST_NUMBERED = MAX_PAYLOAD - 64
"""Largest payload of a numbered message [bytes]; a reply also holds its run and number."""


def ring_key(process: str, topic: Topic) -> str:
    """Key at which the ring of a process answers queries for a topic."""
    return f"ring/{process}/{topic.name}"


@dataclass(frozen=True, slots=True)
class Pack:
    """Consecutive messages, compressed: `first` is the number of the first, `size` their bytes."""

    first: int
    count: int
    size: int
    data: bytes | memoryview

    @classmethod
    def of(cls, first: int, payloads: Sequence[bytes], room: Slabs) -> "Pack":
        """Pack the messages from number `first` on into some room."""
        whole = b"".join(_LENGTH.pack(len(payload)) + payload for payload in payloads)
        packed = room.put(zstandard.compress(whole, PACK_LEVEL))
        return cls(first, len(payloads), sum(map(len, payloads)), packed)

    def copied(self) -> "Pack":
        """The same messages, whatever becomes of the room."""
        return replace(self, data=bytes(self.data))

    def messages(self, run: int) -> Iterator[Numbered]:
        """The messages, of this run."""
        whole, at = zstandard.decompress(self.data), 0
        for number in range(self.first, self.first + self.count):
            (length,) = _LENGTH.unpack_from(whole, at)
            at += _LENGTH.size + length
            yield Numbered(run, number, whole[at - length : at])


class MessageRing:
    """The newest messages of one topic of one run; all but the last ones are kept compressed.

    Args:
        run: the process's run.
        capacity: total size of the payloads that are kept at least, before compression [bytes].
    """

    def __init__(self, run: int, capacity: int = RING_BYTES) -> None:
        self._run, self._capacity = run, capacity
        # Rings of one process that pack at one moment would delay each other's messages.
        self._most_kept = 2 * PACKED - run % PACKED
        self._packs: deque[Pack] = deque()
        self._room = Slabs()
        self._kept: deque[bytes] = deque()  # the newest, up to the number before `_next`
        self._bytes = 0
        self._next = 0
        self._lock = threading.Lock()

    def add(self, payload: bytes) -> Numbered:
        """Number and store a payload, replacing the oldest if full."""
        return Numbered(self._run, self.keep(payload), payload)

    @property
    def place(self) -> tuple[int, int]:
        """Run, and number of the next message."""
        return self._run, self._next

    def keep(self, payload: bytes) -> int:
        """The same for a payload that its sender marks itself: its number."""
        with self._lock:
            number = self._next
            self._next += 1
            self._kept.append(payload)
            self._bytes += len(payload)
            if len(self._kept) >= self._most_kept:
                first = self._first_kept
                older = [self._kept.popleft() for _ in range(PACKED)]
                self._packs.append(Pack.of(first, older, self._room))
            if self._bytes > self._capacity:
                self._forget()
            return number

    @property
    def _first_kept(self) -> int:
        """Number of the oldest message that is not packed."""
        return self._next - len(self._kept)

    def _forget(self) -> None:
        while self._packs and self._bytes - self._packs[0].size >= self._capacity:
            self._bytes -= self._packs.popleft().size
            self._room.drop_oldest()
        while not self._packs and self._bytes > self._capacity:
            self._bytes -= len(self._kept.popleft())

    def reply(self, ask: Ask) -> RingReply[Numbered]:
        """The requested messages still stored, as many as fit into one reply."""
        if ask.boot != self._run:
            return RingReply(ask.boot, UNKNOWN, ())
        with self._lock:  # for a moment only: it delays publishing
            packs = [pack.messages(self._run) for pack in self._copied(ask.first)]
            kept, first, newest = tuple(self._kept), self._first_kept, self._next - 1
        unpacked = starmap(partial(Numbered, self._run), enumerate(kept, first))
        stored = chain(chain.from_iterable(packs), unpacked)
        later = (message for message in stored if message.seq >= ask.first)
        found = first_fitting(later, ask.last, REPLY_BYTES)
        settled = found[-1].seq if found else min(ask.last, newest)
        return RingReply(self._run, settled, found)

    def _copied(self, first: int) -> Iterator[Pack]:
        """The packs that a reply from number `first` on needs."""
        beside = 0  # of the first one, which may hold earlier messages [bytes]
        for pack in self._packs:
            if pack.first + pack.count > first and beside <= REPLY_BYTES:
                yield pack.copied()
                beside += pack.size if pack.first >= first else 0


def capacity_of(topic: Topic, ring_bytes: int) -> int:
    """Capacity of a topic's ring [bytes]."""
    return ring_bytes if topic.rate_hz else min(ring_bytes, RARE_BYTES)


class Outlet:
    """The numbered topics of one process: all its messages on them are sent through here.

    Args:
        transport: carries the bytes.
        rig, process: of the sender.
        ring_bytes: capacity of each topic's ring [bytes], of rare messages at most `RARE_BYTES`.
        kept: file of the alarms that are sent, None for none; it answers for earlier runs.
        counted: given what answers the queries of a topic, counts those that are none.
    """

    def __init__(
        self,
        transport: Transport,
        rig: str,
        process: str,
        ring_bytes: int = RING_BYTES,
        kept: KeptMessages | None = None,
        *,
        counted: Callable[[Answer], Answer],
    ) -> None:
        self.run = 1 + secrets.randbits(52)
        self._kept, self._counted = kept, counted
        self._transport = transport
        self._rig, self._process = rig, process
        self._rings = {
            topic.name: MessageRing(self.run, capacity_of(topic, ring_bytes))
            for topic in TOPICS
            if topic.numbered
        }
        past = kept.past if kept else None
        if kept:
            kept.begin(self.run)
        for topic in TOPICS:
            if topic.numbered:
                before = past if topic is ALARMS else None
                self._serve(bus_key(rig, ring_key(process, topic)), self._rings[topic.name], before)
        self._token = NamedToken(transport, bus_key(rig, f"{SAID_KEY}/{process}"))
        self._token.declare(f"{self.run}/{time.time_ns()}")

    def _serve(self, key: str, ring: MessageRing, past: PastRuns | None) -> None:
        def answer(question: bytes) -> list[bytes]:
            ask = Ask.from_bytes(question)
            answers = past if past is not None and ask.boot != self.run else ring
            return [answers.reply(ask).to_bytes()]

        self._transport.serve(key, self._counted(answer))

    def ring_of(self, topic: Topic) -> MessageRing:
        """The ring of a numbered topic: what is kept there and sent otherwise has its number."""
        return self._rings[topic.name]

    def put(self, topic: Topic, payload: bytes) -> None:
        """Store a message, then send it."""
        message = self._rings[topic.name].add(payload)
        if self._kept and topic is ALARMS:
            self._kept.write(message)
        send(self._transport, self._rig, topic, self._process, payload, mark=message.mark)
