"""Samples in order, none twice, none silently missing: a reader's logic, without clock or bus.

Numbered messages use the same logic: below, a sample may also be a message.

Blocks may arrive late, twice, in any order, or not at all; replies of the ring fill the gaps. Each
sample of the source in control is output as exactly one of

    SampleBlock    delivered, in the order of `seq`, boot after boot
    Loss           permanently lost

In addition the logic outputs queries for missing samples (`Ask`) and remarks (`Remark`). A block in
order is output in the same call; only blocks behind a gap wait.
"""

from collections import deque
from typing import Generic

from rigwatch.wire.ordering.numbered import NumberedRun
from rigwatch.wire.ordering.outcomes import (
    FORGED,
    POSITION_WRONG,
    Counters,
    Loss,
    Outcome,
    Remark,
)
from rigwatch.wire.ordering.ring_protocol import OPEN, UNKNOWN, Ask, RingReply, S
from rigwatch.wire.ordering.source_arbitration import REMEMBERED, Sources
from rigwatch.wire.ordering.stream import Stream, from_number, up_to_number

LARGEST_SEQ = 2**53
"""Largest plausible sample number; larger ones are invalid."""
SUSPECT = 256
"""Number of old samples after which the ring is queried whether the reader's position is wrong."""
TRIES = 5
"""Number of unanswered queries, while newer samples arrive, before a gap is given up by a reader
that is not patient, or by any if nobody is there to answer.
"""


class SampleOrder(Generic[S]):
    """Turns received blocks into ordered samples and reported losses.

    Args:
        resume_after: (boot, seq) of the last sample processed by an earlier run: everything after
            it is delivered, recovered or reported.
        history: number of samples before those that are also queried, if the ring still has them;
            without `resume_after`, samples before the first one received.
        capacity: samples that may wait behind a gap before it is given up.
        patient: go on asking as long as a source lives and `capacity` allows: a ring may be slow to
            answer, and what it still has is not lost. A reader that judges samples as they come
            prefers the newest after some tries.
    """

    def __init__(
        self,
        resume_after: tuple[int, int] | None = None,
        history: int = 0,
        capacity: int = 65536,
        *,
        patient: bool = False,
    ) -> None:
        self.counters = Counters()
        self.sources = Sources()
        self._history = history
        self._capacity = capacity
        self._patient = patient
        self._line: deque[Stream[S]] = deque()
        self._settled_boots: dict[int, int] = {}
        self._asked: Ask | None = None
        self._unanswered = 0
        self._heard_since_ask = False
        self._stale = 0
        self._out: list[Outcome[S]] = []
        if resume_after is not None:
            # Assumed alive until the existing tokens have been listed.
            self.sources.appeared(resume_after[0], 0)
            boot, seq = resume_after[0], resume_after[1] + 1
            self._control(Stream(boot, max(0, seq - history), promised_from=seq))

    def on_block(self, block: S) -> list[Outcome[S]]:
        """Process a block received from the bus."""
        if self.goes_on(block):
            return [block]
        if 0 <= block.seq <= LARGEST_SEQ - len(block):
            if len(block):
                self._admit(block)
        else:
            self.counters.foreign += len(block)
        return self._outcomes()

    def goes_on(self, block: S | NumberedRun) -> bool:
        """Deliver a block that simply follows the last one, as nearly all do; else do nothing.

        What `on_block` would do with it, in a quarter of its time.
        """
        front, count = self._line[0] if self._line else None, len(block)
        if front is None or block.seq != front.next or block.boot != front.boot or not count:
            return False
        if front.waiting or front.ended or block.seq > LARGEST_SEQ - count:
            return False
        if not self.sources.goes_on(block):
            return False
        self._pass(front, count)
        return True

    def _pass(self, front: Stream[S], count: int) -> None:
        self._heard_since_ask, self._stale = True, 0
        front.next += count
        self.counters.delivered += count

    @property
    def goes_on_after(self) -> tuple[int, int] | None:
        """(boot, seq) of the last sample if one that follows is delivered at once, else None."""
        front = self._line[0] if self._line else None
        if front is None or front.waiting or front.ended or front.next > LARGEST_SEQ // 2:
            return None
        return self.position if self.sources.is_unrivalled(front.boot) else None

    def went_on(self, count: int, t_ns: int) -> None:
        """So many samples that follow have been delivered, where `goes_on_after` says so.

        Args:
            count: of them.
            t_ns: time of the last one [ns].
        """
        self.sources.went_on(t_ns)
        self._pass(self._line[0], count)

    def on_reply(self, ask: Ask, reply: RingReply[S] | None) -> list[Outcome[S]]:
        """Process the ring's reply to `ask`; None if there was none."""
        if ask == self._asked:
            self._asked = None
            if reply is None:
                self._no_reply(ask)
            else:
                self._settle(ask, reply)
        return self._outcomes()

    def on_token(self, boot: int, since_ns: int, alive: bool) -> list[Outcome[S]]:
        """Process the appearance or end of a source's liveliness token."""
        if alive:
            self.sources.appeared(boot, since_ns)
            if self.sources.returns(boot):
                self._change_control((boot, 0))
        else:
            self._vanished(boot, since_ns)
        return self._outcomes()

    def follow(self, boot: int) -> list[Outcome[S]]:
        """Follow a live source from its first sample if the one in control is gone."""
        if self.sources.current != boot and not self.sources.is_alive(self.sources.current or 0):
            self._change_control((boot, 0))
        return self._outcomes()

    def pass_over(self) -> list[Outcome[S]]:
        """Join the oldest source that sends, if none was joined: those before it are silent."""
        if (found := self.sources.pass_over()) is not None:
            boot, seq = found
            text = f"boot {boot} is read; a source that came before it sends nothing"
            self._out.append(Remark("error", "DUPLICATE SOURCE", text))
            self._join(boot, seq)
        return self._outcomes()

    def on_silence(self) -> list[Outcome[S]]:
        """Handle silence: lost samples at the end are not revealed by a successor."""
        self._change_control(self.sources.fell_silent())
        if self._line and self._asked is None and not self._line[0].ended:
            self._ask(Ask(self._line[0].boot, self._line[0].next, OPEN))
        return self._outcomes()

    @property
    def position(self) -> tuple[int, int] | None:
        """(boot, seq) of the last processed sample; None before the first."""
        return (self._line[0].boot, self._line[0].next - 1) if self._line else None

    # ---- which source -------------------------------------------------------------------

    def _admit(self, block: S) -> None:
        verdict = self.sources.judge(block)
        if verdict.remark:
            self._out.append(Remark("error", "DUPLICATE SOURCE", verdict.remark))
        if verdict.control_from is not None:
            self._change_control((block.boot, verdict.control_from))
        stream = self._stream(block.boot)
        if stream is None:
            self._drop(block)
            return
        self._heard_since_ask = True
        self._store(stream, block)

    def _drop(self, block: S) -> None:
        if block.seq + len(block) <= self._settled_boots.get(block.boot, 0):
            self.counters.duplicates += len(block)
        else:
            self.counters.foreign += len(block)

    def _vanished(self, boot: int, since_ns: int) -> None:
        skipped = self.sources.vanished(boot, since_ns)
        if skipped is not None:
            self._lose(boot, *skipped, "another source had control")
        self._change_control(self.sources.successor())

    def _change_control(self, successor: tuple[int, int] | None) -> None:
        if successor is None:
            return
        boot, seq = successor
        if not self._line:
            self._join(boot, seq)
            return
        self._line[-1].ended = True
        self._out.append(Remark("warning", "SOURCE RESTARTED", f"boot {boot} has control now"))
        resumed = self._resumed_at(boot)
        skipped_from = self.sources.skipped_from(boot, resumed)
        if skipped_from < seq:
            self._lose(boot, skipped_from, seq - 1, "another source had control")
        self._control(Stream(boot, max(seq, resumed)))

    def _resumed_at(self, boot: int) -> int:
        """Next sample of a boot that had control before; 0 for a new one."""
        stream = self._stream(boot)
        if stream is None:
            return self._settled_boots.pop(boot, 0)
        if stream is self._line[0]:
            self._asked = None
        self._line.remove(stream)
        return stream.next

    def _join(self, boot: int, seq: int) -> None:
        self._control(Stream(boot, max(0, seq - self._history), promised_from=seq))
        self._out.append(Remark("info", "JOINED", f"joined boot {boot} at seq {seq}"))

    def _control(self, stream: Stream[S]) -> None:
        self._line.append(stream)
        self.sources.take_control(stream.boot)

    def _stream(self, boot: int) -> Stream[S] | None:
        return next((stream for stream in self._line if stream.boot == boot), None)

    # ---- order within the sources in line -----------------------------------------------

    def _store(self, stream: Stream[S], block: S) -> None:
        fresh = from_number(block, stream.next)
        self.counters.duplicates += len(block) - (len(fresh) if fresh else 0)
        self._stale = 0 if fresh else self._stale + len(block)
        if fresh is None:
            self._suspect_itself()
            return
        if fresh.seq == stream.next and stream is self._line[0] and not stream.waiting:
            self._deliver(stream, fresh)
        else:
            stream.hold(fresh)

    def _suspect_itself(self) -> None:
        """Query the ring after many old samples, as the position may be wrong."""
        front = self._line[0]
        if self._stale >= SUSPECT and self._asked is None and not front.ended:
            self._stale = 0
            self._ask(Ask(front.boot, front.next, OPEN))

    def _deliver(self, stream: Stream[S], block: S) -> None:
        fresh = from_number(block, stream.next)
        if fresh is not None:
            stream.next = fresh.seq + len(fresh)
            self.counters.delivered += len(fresh)
            self._out.append(fresh)

    def _lose(self, boot: int, first: int, last: int, reason: str) -> None:
        self.counters.lost += max(0, last - first + 1)
        self._out.append(Loss(boot, first, last, reason))

    def _outcomes(self) -> list[Outcome[S]]:
        self._advance()
        done, self._out = self._out, []
        return done

    def _advance(self) -> None:
        while self._line:
            front = self._line[0]
            self._release(front)
            if self._asked is not None:
                return
            if front.waiting:
                self._ask(Ask(front.boot, front.next, front.first_waiting() - 1))
            elif front.ended:
                self._ask(Ask(front.boot, front.next, OPEN))
            else:
                return

    def _release(self, front: Stream[S]) -> None:
        """Deliver the waiting blocks that are next, or that exceed the capacity."""
        while front.waiting:
            if front.samples_waiting > self._capacity:
                self._skip(front, front.first_waiting() - 1, "too many samples waited behind them")
                self._asked = None
            if front.first_waiting() > front.next:
                return
            self._deliver(front, front.take())

    # ---- the ring -----------------------------------------------------------------------

    def _ask(self, ask: Ask) -> None:
        self._asked = ask
        self._heard_since_ask = False
        self._out.append(ask)

    def _settle(self, ask: Ask, reply: RingReply[S]) -> None:
        front = self._line[0]
        if reply.settled <= UNKNOWN and self._still_sends(front):
            # Another source's ring: after an interruption it may be reachable first.
            self._no_reply(ask)
            return
        self._unanswered = 0
        if reply.settled == UNKNOWN:
            self._give_up(front, ask, "the source has restarted since")
            if front.ended:
                self._learn_of(reply.blocks)
            return
        if UNKNOWN < reply.settled < ask.first - 1 and not front.ended:
            self._set_back(front, reply.settled + 1)
            return
        if reply.settled < ask.first and ask.last != OPEN:
            self._drop_forged(front)
            return
        for block in (one for one in reply.blocks if one.boot == front.boot):
            before = self.counters.delivered
            self._skip(front, min(block.seq, ask.last + 1) - 1, "the ring no longer has them")
            self._take_recovered(front, block, ask.last)
            self.counters.recovered += self.counters.delivered - before
        self._skip(front, min(reply.settled, ask.last), "the ring no longer has them")
        if ask.last == OPEN and front.ended and not self._progressed(ask, front):
            self._leave(front)
            self._learn_of(reply.blocks)

    def _learn_of(self, blocks: tuple[S, ...]) -> None:
        """Put a boot that began and ended unseen before the one that has control now."""
        for block in blocks:
            known = block.boot in self._settled_boots or self._stream(block.boot) is not None
            if self._line and not known:
                unseen = Stream[S](block.boot, 0)
                unseen.ended = True
                self._line.appendleft(unseen)

    def _still_sends(self, front: Stream[S]) -> bool:
        return self.sources.is_alive(front.boot) or (bool(front.waiting) and not front.ended)

    def _drop_forged(self, front: Stream[S]) -> None:
        """Drop forged samples: every sample is in the ring before it is published.

        A sample that arrived during the query is also dropped, and recovered from the ring.
        """
        self.counters.foreign += front.samples_waiting
        front.drop_waiting()
        text = f"samples of boot {front.boot} that its source never sent; they are dropped"
        self._out.append(Remark("error", FORGED, text))

    def _set_back(self, front: Stream[S], seq: int) -> None:
        """Correct a position beyond the newest sample of the source."""
        told = f"sample {front.next - 1} of boot {front.boot} lies beyond its newest, {seq - 1}"
        self._out.append(Remark("error", POSITION_WRONG, f"{told}; reading continues from there"))
        self._lose(front.boot, seq, seq - 1, "the resume position was wrong")
        front.drop_waiting()
        front.next = front.promised_from = seq

    def _take_recovered(self, front: Stream[S], block: S, last: int) -> None:
        if block.seq <= min(front.next, last):
            self._deliver(front, up_to_number(block, last))

    def _progressed(self, ask: Ask, front: Stream[S]) -> bool:
        return front.next > ask.first or bool(front.waiting)

    def _skip(self, front: Stream[S], last: int, reason: str) -> None:
        """Report everything up to `last` that is not waiting as lost."""
        while front.next <= last:
            hole_end = min(last, front.first_waiting() - 1)
            if front.next <= hole_end:
                self._miss(front, hole_end, reason)
            elif front.waiting:
                self._deliver(front, front.take())

    def _miss(self, front: Stream[S], last: int, reason: str) -> None:
        if last >= front.promised_from:
            self._lose(front.boot, max(front.next, front.promised_from), last, reason)
        front.next = last + 1

    def _no_reply(self, ask: Ask) -> None:
        # Without any samples the link is down: the ring is available again once it recovers.
        alone = not self._heard_since_ask and self.sources.is_alive(ask.boot)
        self._unanswered += 0 if alone else 1
        again = self._unanswered < TRIES or (self._patient and self._may_still_answer())
        if again and (ask.last != OPEN or self._line[0].ended):
            self._ask(ask)
            return
        self._unanswered = 0
        self._give_up(self._line[0], ask, "no source could be queried for them")

    def _may_still_answer(self) -> bool:
        """Whether a source lives, and what waits is less than the reader may hold."""
        waiting = sum(stream.samples_waiting for stream in self._line)
        return self.sources.any_alive and waiting <= self._capacity

    def _give_up(self, front: Stream[S], ask: Ask, reason: str) -> None:
        if ask.last != OPEN:
            self._skip(front, ask.last, reason)
        elif front.ended:
            self._lose(front.boot, front.next, front.next - 1, reason)
            self._leave(front)

    def _leave(self, front: Stream[S]) -> None:
        self._settled_boots[front.boot] = front.next
        if len(self._settled_boots) > REMEMBERED:
            del self._settled_boots[next(iter(self._settled_boots))]
        self._line.popleft()
