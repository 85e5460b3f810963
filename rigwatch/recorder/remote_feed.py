"""The recorded topics of a rig of another site, over a link that may be cut.

    bus ──▶ rings ──gaps──▶ BlockStream, Outage ──▶ messages, complete and each once
                              │ Hole      ▲
                              ▼           │
                         PastQuestions ───┘   the site's recordings

After a cut the rings give what they still have. Behind what they no longer have, samples and
estimates wait until the site's recordings have answered, so that the recording stays in order.
"""

import contextlib
from collections.abc import Iterator, Sequence
from queue import Empty, SimpleQueue

from rigwatch.recorder.feed import CATCH_UP, Feed
from rigwatch.recorder.folders import Place, last_block
from rigwatch.recorder.past import (
    MARGIN_NS,
    Answer,
    BlockStream,
    Hole,
    Outage,
    PastQuestions,
    Question,
)
from rigwatch.recorder.positions import Positions
from rigwatch.wire.bus import Bus, CompleteSubscription, Subscription
from rigwatch.wire.messages import (
    ALIVE_KEY,
    ESTIMATES,
    GAPS,
    RUN,
    SAMPLES,
    TOPICS,
    Block,
    Gap,
    Message,
    decode,
)
from rigwatch.wire.session import Session, open_session

_SITE = frozenset(f"{ALIVE_KEY}/{name}" for name in ("daq", "monitor", "recorder"))
_RECORDER = f"{ALIVE_KEY}/recorder"
_OTHERS = "others"
_PLAIN = tuple(
    line.name for line in TOPICS if line.recorded and line not in (SAMPLES, ESTIMATES, RUN)
)


class RemoteFeed(Feed):
    """The recorded topics of a rig of another site.

    Args:
        bus: of a router that is linked to the site's.
        place: where the recording goes on.
        catch_up: see `Feed`.
    """

    def __init__(self, bus: Bus, place: Place, catch_up: float = CATCH_UP) -> None:
        super().__init__(bus, place.last, place.positions, gaps_may_fill=True, catch_up=catch_up)
        self._bus = bus
        self._streams, self._outage = resumed(place)
        self._asked: dict[str, Hole] = {}
        self._lost = dict.fromkeys(self._numbered, 0)
        self._position = self._numbered[ESTIMATES.name].positions()
        self._present: set[str] = set()
        self._tokens: SimpleQueue[tuple[str, bool]] = SimpleQueue()
        self._questions = PastQuestions(bus, lambda: bool(self._present & _SITE))
        self._unwatch = bus.watch_tokens(f"{ALIVE_KEY}/*", lambda *token: self._tokens.put(token))

    def take(self) -> list[Message]:
        """Messages received since the last call; does not wait."""
        self._take_tokens()
        found = [*self._answered(), *self._of_stream(SAMPLES.name)]
        for subscription in self._others:
            found += self._of_topic(subscription)
        self._ask()
        return self._counted(found)

    def rest(self) -> list[Message]:
        """What was taken and still waits, at the end."""
        rest = [message for stream in self._streams.values() for message in stream.rest()]
        return [*rest, *self._reported(self._outage.rest())]

    def positions(self) -> Positions:
        """Positions in the numbered topics, before the estimates that wait."""
        found = super().positions()
        if not self._streams[ESTIMATES.name].holds:
            self._position = found[ESTIMATES.name]
        return found | {ESTIMATES.name: self._position}

    def lost(self, topic: str) -> int:
        """Messages of numbered topics known to be lost."""
        return self._lost[topic]

    def figures(self) -> dict[str, float]:
        """What recordings have filled in, and how far the present answer has come."""
        filled = {f"filled_{name}": float(one.filled) for name, one in self._streams.items()}
        share = min((one.share for one in self._streams.values()), default=1.0)
        return {
            **filled,
            "filled_messages": float(self._outage.filled),
            "filling": float(bool(self._asked)),
            "filled_share": share,
        }

    def close(self) -> None:
        """Stop receiving and asking."""
        self._unwatch()
        self._questions.close()
        super().close()

    # ---- from the bus -------------------------------------------------------------------

    def _take_tokens(self) -> None:
        with contextlib.suppress(Empty):
            while True:
                key, alive = self._tokens.get_nowait()
                (self._present.add if alive else self._present.discard)(key)
                if key == _RECORDER:
                    self._outage.link(alive)

    def _of_topic(self, subscription: Subscription) -> list[Message]:
        if subscription.topic is ESTIMATES:
            return self._of_stream(ESTIMATES.name)
        found: list[Message] = []
        numbered = subscription.topic.numbered
        for message in self._drained(subscription):
            if numbered and isinstance(message, Gap):
                found += self._reported(self._outage.gap(message))
            elif self._outage.hear(message):
                found.append(message)
        if isinstance(subscription, CompleteSubscription):
            found += subscription.reports()
        return found

    def _of_stream(self, name: str) -> list[Message]:
        stream = self._streams[name]
        if stream.hole is not None:
            return []  # Waits in the inbox, which is bounded, and then in the ring.
        if name == SAMPLES.name:
            found: list[Message] = [*self._reader.read(0.0)]
        else:
            found = [
                *self._numbered[name].catch_up(self._catch_up),
                *self._numbered[name].reports(),
            ]
        return self._reported(stream.add(found))

    # ---- from the recordings ------------------------------------------------------------

    def _ask(self) -> None:
        wanted = {name: (one.hole, (name,)) for name, one in self._streams.items()}
        for name, (hole, topics) in (wanted | {_OTHERS: (self._outage.span, _PLAIN)}).items():
            if hole is not None and self._asked.get(name) != hole:
                self._asked[name] = hole
                self._questions.ask(name, Question(topics, hole.start, hole.end + 1))

    def _answered(self) -> list[Message]:
        found: list[Message] = []
        for answer in self._questions.taken():
            found += self._reported(
                self._to_outage(answer) if answer.name == _OTHERS else self._to_stream(answer)
            )
        return found

    def _to_stream(self, answer: Answer) -> list[Message]:
        stream = self._streams[answer.name]
        blocks = [decode(line.message, data) for line, data in answer.parts]
        found = stream.fill([block for block in blocks if isinstance(block, Block)])
        if answer.ended:
            del self._asked[answer.name]
            found += stream.end(answered=answer.complete)
        return found

    def _to_outage(self, answer: Answer) -> list[Message]:
        fresh = self._outage.fill(answer.parts)
        found = [message for message in fresh if not self._is_own(message)]
        if answer.ended and self._asked.pop(_OTHERS, None) == self._outage.span:
            found += self._outage.end(answered=answer.complete)
        return found

    def _reported(self, found: Sequence[Message]) -> list[Message]:
        """The messages; own gaps among them are final, and are published and counted."""
        for gap in found:
            if isinstance(gap, Gap) and gap.reporter == self._name:
                self._bus.publish(GAPS, gap)
                if gap.topic:
                    self._lost[gap.topic] += max(0, gap.last - gap.first + 1)
        return [*found]


def resumed(place: Place) -> tuple[dict[str, BlockStream], Outage]:
    """The streams and the outage of a recording that goes on at `place`."""
    if place.last is None:
        return {SAMPLES.name: BlockStream(), ESTIMATES.name: BlockStream()}, Outage()
    session = open_session(place.folder)
    last = {line.name: last_block(session, line) for line in (SAMPLES, ESTIMATES)}
    began = max(int(block.t_ns[-1]) for block in last.values() if block is not None)
    outage = Outage(began)
    for message in _since(session, began - MARGIN_NS):
        outage.know(message)
    return {name: BlockStream(block) for name, block in last.items()}, outage


def _since(session: Session, start: int) -> Iterator[Message]:
    """Messages other than blocks, of the last segments back to one that began before `start`."""
    for path in reversed(session.segments):
        one = Session(path, (path,))
        yield from (recorded.message for recorded in one.messages(_PLAIN))
        first = next(one.samples(size=1), None)
        if first is not None and first.t_ns[0] < start:
            return
