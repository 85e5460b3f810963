"""Reads a rig's samples from the bus: each is delivered, recovered or reported as a gap.

    bus ──blocks, tokens──▶ inbox ──▶ SampleOrder ──▶ blocks and gaps in order
                              ▲            │ Ask
                              └──replies── queries, sent from a separate thread

All logic is in `sample_order.py`; a block in order passes straight through, in the reader's thread.
"""

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby

from rigwatch.wire.bus import (
    MAX_PAYLOAD,
    QUEUE_CAPACITY,
    Bus,
    Inbox,
    JointReceiver,
    RingQuestions,
    Share,
    Source,
    sender_named,
)
from rigwatch.wire.delivery.ring import SOURCE_KEY
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import (
    EVENTS,
    GAPS,
    RING_KEY,
    SAMPLES,
    Event,
    Form,
    Gap,
    SampleBlock,
    concatenate,
    continues,
    decode_all,
)
from rigwatch.wire.ordering import (
    FORGED,
    Ask,
    Counters,
    Loss,
    Outcome,
    Owners,
    Remark,
    RingReply,
    SampleOrder,
)

SILENCE = 1.0
"""Time without a sample after which the ring is queried for more [s]."""
CONTESTED = 1.0
"""Time for which samples sent under another process's boot count as a conflict [s]."""
BEYOND_LEASE = 5.0
"""Time beyond the lease of its link for which a source that came first may be silent while another
sends, before a reader that has heard nothing of it passes it over: the token of one that is gone
lasts as long as the lease [s]."""
MOST_UNSURE = 16
"""Boots of which that is followed at a time: a stranger may call any number his own."""
MOST_REJECTED = 8
"""Senders whose invalid payloads are counted separately: identities cost a stranger nothing."""

Item = SampleBlock | Gap | Event
_Payload = tuple[bytes, str]
_Incoming = _Payload | tuple[int, int, str | None] | tuple[Ask, RingReply[SampleBlock] | None]


class SampleReader:
    """One reader of the samples; not thread-safe.

    Gaps and events are returned by `read` in their place among the samples, and are also published.

    Args:
        bus: source of the samples; `bus.process` is named in gaps and events.
        resume_after: (boot, seq) of the last sample that an earlier run of this process has
            processed, so reading continues after it.
        history: number of samples before those (or before the first received) that are also read
            if the ring has them; missing ones are not a gap.
        capacity: messages queued for a slow reader before further ones are left to the ring.
        publish_gaps: whether gaps are also published; not if they may still be filled.
        patient: see `SampleOrder`.

    Attributes:
        heard: whether a sample block of the source in control was ever received.
        rejected: payloads that were not sample blocks.
        rejected_by: the same by sender, for the first `MOST_REJECTED` of them.
        dropped: payloads left to the ring because the inbox was full; what a channel of the
            transport drops is counted only as recovered.
    """

    def __init__(
        self,
        bus: Bus,
        resume_after: tuple[int, int] | None = None,
        history: int = 0,
        capacity: int = QUEUE_CAPACITY,
        *,
        publish_gaps: bool = True,
        patient: bool = False,
    ) -> None:
        self.heard = False
        self.rejected = 0
        self.rejected_by: Counter[str] = Counter()
        self.dropped = 0
        self._bus, self._publish_gaps = bus, publish_gaps
        self._order: SampleOrder[SampleBlock] = SampleOrder(resume_after, history, patient=patient)
        self._owners = Owners()
        self._refused: tuple[int, str] | None = None
        self._impostor_at: float | None = None
        self._assumed: int | None = None
        self._unsure = _Unsure(bus.lease + BEYOND_LEASE)
        self._inbox: Inbox[_Incoming] = Inbox(capacity)
        self._questions = RingQuestions(bus, self._answered)
        self._heard_at = self._silence_told_at = time.monotonic()
        self._latest_ns = 0
        self._device = ""
        self._ready: list[Item] = []
        self._start(resume_after)

    def _start(self, resume_after: tuple[int, int] | None) -> None:
        there = self._bus.names(SOURCE_KEY)
        for place, name in there:
            self._token(place, name, True)
        if resume_after is not None:
            self._assumed = resume_after[0]
            if all(name is not None for _, name in there):
                self._end_assumed()
        self._closers = [
            self._bus.watch_names(SOURCE_KEY, self._token),
            self._inbox.follow(self._bus, SAMPLES, self._receive),
        ]

    def __len__(self) -> int:
        return len(self._inbox)

    def may_hold(self) -> bool:
        """Whether something may have come: a look that costs less than the number of messages."""
        return self._inbox.may_hold()

    @property
    def joint(self) -> JointReceiver | None:
        """What receives the samples of this rig among those of others; None if nothing does."""
        share = self._inbox.outside
        return share.of if isinstance(share, Share) else None

    @property
    def counters(self) -> Counters:
        """Counts of delivered, recovered and lost samples so far."""
        return self._order.counters

    @property
    def position(self) -> tuple[int, int] | None:
        """(boot, seq) of the last sample returned or reported; None before the first."""
        return self._order.position

    @property
    def contested(self) -> bool:
        """Whether a second source sends samples besides the one that is read, or under its boot."""
        at = self._impostor_at
        impostor = at is not None and time.monotonic() - at < CONTESTED
        boot = self._order.sources.current
        passed_over = boot is not None and self._owners.is_contested(boot)
        return impostor or passed_over or self._order.sources.contested

    def is_source(self, boot: int, sender: str) -> bool:
        """Whether the identity `sender` may speak for a boot.

        That is its owner; for a boot of which nothing was heard, the owner of the one in control.
        """
        in_control = self._order.sources.current
        owner = self._owners.owner_of(boot)
        if not owner and in_control is not None:
            owner = self._owners.owner_of(in_control)
        return owner == sender

    def open_row(self, suits: Callable[[Form], bool]) -> tuple[int, int] | None:
        """Leave samples that simply follow to the row of this rig, if it can have one.

        That is until `Share.keep_order` is called, by whatever else comes. What the row has taken
        is told by `went_on`, before anything is read here again.

        Args:
            suits: whether blocks of a form of their device and boot can be taken there; asked once.

        Returns:
            (boot, seq) of the last sample that was read; None if the row remains closed.
        """
        share, position = self._inbox.outside, self._order.goes_on_after
        if not isinstance(share, Share) or position is None or self._ready:
            return None
        boot, device = position[0], self._device
        sender = self._owners.owner_of(boot)
        doubted = self._refused is not None and self._refused[0] == boot
        if not self.heard or doubted or not sender or not self._owners.admits(boot, sender):
            return None
        source = Source(sender, device, boot, suits)
        opened = share.of.open(share, source, position[1] + 1, self._inbox.is_read)
        return position if opened else None

    @property
    def device(self) -> str:
        """The device of the last sample that was read."""
        return self._device

    def close_row(self) -> None:
        """Read all that comes here again."""
        self._inbox.keep_order()

    def went_on(self, count: int, heard_at: float, t_ns: int) -> None:
        """The row has taken samples since it was opened.

        Args:
            count: of them; nothing is told of none.
            heard_at: monotonic time of the last ones [s].
            t_ns: Unix time of the last one [ns].
        """
        self._order.went_on(count, t_ns)
        self._latest_ns = t_ns
        self._heard_at = self._silence_told_at = heard_at
        self._unsure.end()

    def silent_for(self) -> float:
        """Time since the last sample, or since the start [s]."""
        return time.monotonic() - self._heard_at

    def read(self, timeout: float) -> list[Item]:
        """Items received since the last call, in order; waits up to `timeout` [s] for the first.

        Consecutive blocks are joined: a reader that is behind gets fewer and longer blocks.
        """
        deadline = time.monotonic() + timeout
        while not self._ready:
            waiting = self._inbox.take(deadline - time.monotonic())
            if not waiting:
                break
            self._take_all(waiting)
        self._check_silence()
        items, self._ready = self._ready, []
        return joined(items)

    def close(self) -> None:
        """Stop reading."""
        for close in self._closers:
            close()
        self._questions.close()

    # ---- called in the bus's threads ----------------------------------------------------

    def _receive(self, payload: bytes, sender: str, _mark: bytes) -> None:
        if len(payload) > MAX_PAYLOAD:
            self._reject(sender)
        elif not self._inbox.accept((payload, sender)):
            self.dropped += 1

    def _reject(self, sender: str) -> None:
        self.rejected += 1
        if sender in self.rejected_by or len(self.rejected_by) < MOST_REJECTED:
            self.rejected_by[sender] += 1

    def _token(self, _place: str, name: str | None, alive: bool) -> None:
        if named := sender_named(name):
            boot, since_ns, sender = named
            self._inbox.put((boot, since_ns, sender if alive else None))
        if name is not None or not alive:
            self._end_assumed()

    def _end_assumed(self) -> None:
        """Once the names of the sources are known: one that is not among them is gone."""
        boot, self._assumed = self._assumed, None
        if boot is not None:
            self._inbox.put((boot, 0, None))

    # ---- called in the reader's thread --------------------------------------------------

    def _take_all(self, incoming: Iterable[_Incoming]) -> None:
        """Take them in order; blocks that one sender sent one after the other are read together."""
        for sender, some in groupby(incoming, _sender):
            if sender is None:
                for one in some:
                    self._take(one)
            else:
                self._take_blocks([one[0] for one in some if isinstance(one[0], bytes)], sender)

    def _take(self, incoming: _Incoming) -> None:
        if len(incoming) == 3:
            self._take_token(*incoming)
        elif isinstance(incoming[0], Ask):
            self._handle(self._order.on_reply(*incoming))

    def _take_token(self, boot: int, since_ns: int, sender: str | None) -> None:
        if sender is None:
            self._owners.vanished(boot, since_ns)
        else:
            self._owners.appeared(boot, since_ns, sender)
        self._handle(self._order.on_token(boot, since_ns, sender is not None))

    def _take_blocks(self, payloads: Sequence[bytes], sender: str) -> None:
        blocks, rejected = decode_all(SampleBlock, payloads)
        for _ in range(rejected):
            self._reject(sender)
        for block in blocks:
            self._take_block(block, sender)

    def _take_block(self, block: SampleBlock, sender: str) -> None:
        if not self._owners.admits(block.boot, sender):
            self._refuse(block, sender)
            return
        self._notice_impostor(block.boot, sender)
        self._handle(self._order.on_block(block))
        if block.boot == self._order.sources.current:
            self.heard = True
            self._heard_at = self._silence_told_at = time.monotonic()
            self._unsure.end()
        elif self._order.position is None and self._unsure.lasts(None):
            self._unsure.end()
            self._handle(self._order.pass_over())

    def _refuse(self, block: SampleBlock, sender: str) -> None:
        """Refuse samples of a boot that another process owns, if that was ever heard."""
        self.counters.foreign += max(1, len(block))  # one without samples is an attempt, too
        self._refused = block.boot, sender
        if self._owners.is_doubtful(block.boot, sender) and self._unsure.lasts(block.boot):
            self._unsure.end()
            self._owners.pass_over(block.boot)
            text = f"the process that first called itself the source of boot {block.boot} is silent"
            self._report_event(Remark("error", "DUPLICATE SOURCE", f"{text}; another is read"))

    def _notice_impostor(self, boot: int, owner: str) -> None:
        """The owner still sends after foreign samples were refused: report the second sender."""
        # One whose samples came before its token is the owner by now.
        if self._refused is None or self._refused[0] != boot or self._refused[1] == owner:
            return
        if not self.contested:
            text = f"another process sends samples as boot {boot}; they are dropped"
            self._report_event(Remark("error", "DUPLICATE SOURCE", text))
        self._refused, self._impostor_at = None, time.monotonic()

    def _check_silence(self) -> None:
        now = time.monotonic()
        if now - max(self._heard_at, self._silence_told_at) > SILENCE:
            self._silence_told_at = now
            self._handle(self._order.on_silence())

    def _handle(self, outcomes: list[Outcome[SampleBlock]]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, SampleBlock):
                self._device, self._latest_ns = outcome.device, int(outcome.t_ns[-1])
                self._ready.append(outcome)
            elif isinstance(outcome, Ask):
                self._questions.ask(RING_KEY, outcome)
            elif isinstance(outcome, Loss):
                self._report_gap(outcome)
            else:
                if outcome.code == FORGED:
                    self._impostor_at = time.monotonic()
                self._report_event(outcome)

    def _report_event(self, remark: Remark) -> None:
        name, now_ns = self._bus.process, time.time_ns()
        self._report(Event(name, now_ns, remark.severity, remark.code, remark.text))

    def _report_gap(self, loss: Loss) -> None:
        gap = Gap(
            self._device,
            loss.boot,
            loss.first,
            loss.last,
            self._latest_ns or time.time_ns(),
            self._bus.process,
            loss.reason,
        )
        self._report(gap)

    def _report(self, item: Gap | Event) -> None:
        self._ready.append(item)
        if not isinstance(item, Gap):
            self._bus.publish(EVENTS, item)
        elif self._publish_gaps:
            self._bus.publish(GAPS, item)

    # ---- called in the query thread ------------------------------------------------------

    def _answered(self, _key: str, ask: Ask, found: list[bytes]) -> None:
        """Queue the most complete reply; None if there is none."""
        replies = []
        for data in found:
            with contextlib.suppress(MessageError):
                replies.append(RingReply.from_bytes(data))
        own = [reply for reply in replies if reply.boot == ask.boot]
        self._inbox.put((ask, max(own, key=lambda reply: reply.settled, default=None)))


class _Unsure:
    """How long a source that came first has been silent while another sends.

    Of the boot that both call theirs, or of any boot: None.

    Args:
        longest: what counts as long enough [s].
    """

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._since: dict[int | None, float] = {}

    def lasts(self, boot: int | None) -> bool:
        """Whether that has lasted long enough."""
        now = time.monotonic()
        if len(self._since) >= MOST_UNSURE and boot not in self._since:
            del self._since[next(iter(self._since))]
        return now - self._since.setdefault(boot, now) > self._longest

    def end(self) -> None:
        """One is read."""
        self._since.clear()


def _sender(incoming: _Incoming) -> str | None:
    """The sender of a payload; None for anything else."""
    return incoming[1] if isinstance(incoming[0], bytes) else None


def joined(items: list[Item]) -> list[Item]:
    """The items with consecutive sample blocks joined."""
    if len(items) < 2:  # nearly always
        return items
    done: list[Item] = []
    run: list[SampleBlock] = []
    for item in items:
        if isinstance(item, SampleBlock) and (not run or continues(run[-1], item)):
            run.append(item)
            continue
        if run:
            done.append(concatenate(run))
        run = [item] if isinstance(item, SampleBlock) else []
        if not isinstance(item, SampleBlock):
            done.append(item)
    return [*done, concatenate(run)] if run else done
