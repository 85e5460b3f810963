"""The reader's logic against what a network, a ring and restarting devices can do to it."""

from collections import deque
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.wire.delivery.ring import RingStore
from rigwatch.wire.messages.message_types import SampleBlock
from rigwatch.wire.ordering.outcomes import Loss, Outcome, Remark
from rigwatch.wire.ordering.ring_protocol import OPEN, Ask, RingReply
from rigwatch.wire.ordering.sample_order import TRIES, SampleOrder
from tests.bus.samples import Ledger, block


@dataclass
class Bench:
    """A reader's logic with a ring that can be limited, replaced or silent."""

    order: SampleOrder = field(default_factory=SampleOrder)
    capacity: int = 4096
    ring_replies: bool = True
    stores: dict[int, RingStore] = field(default_factory=dict)
    ledger: Ledger = field(default_factory=Ledger)
    losses: list[Loss] = field(default_factory=list)
    remarks: list[Remark] = field(default_factory=list)
    asks: deque[Ask] = field(default_factory=deque)
    asked: int = 0

    def keep(self, part: SampleBlock) -> SampleBlock:
        """Into the ring, as the adapter does before it publishes."""
        store = self.stores.setdefault(part.boot, RingStore(part, self.capacity))
        store.add(part)
        return part

    def take(self, outcomes: list[Outcome]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Ask):
                self.asks.append(outcome)
                self.asked += 1
            elif isinstance(outcome, Remark):
                self.remarks.append(outcome)
            else:
                self.ledger.add(outcome)
                self.losses += [outcome] if isinstance(outcome, Loss) else []

    def send(self, part: SampleBlock) -> None:
        self.take(self.order.on_block(self.keep(part)))

    def reply(self) -> None:
        """Answer the oldest open question."""
        ask = self.asks.popleft()
        known = self.ring_replies and ask.boot in self.stores
        answer = self.stores[ask.boot].reply(ask) if known else None
        carried = RingReply.from_bytes(answer.to_bytes()) if answer else None
        self.take(self.order.on_reply(Ask.from_bytes(ask.to_bytes()), carried))

    def assert_gives_up_a_hole(self) -> None:
        """Samples 1 to 4 are missing, and no query for them is answered."""
        self.send(block(0))
        self.send(block(5))
        for seq in range(6, 6 + TRIES):
            self.send(block(seq))
            self.reply()
        self.ledger.assert_complete(7, 0, 5 + TRIES)
        assert self.ledger.lost(7) == 4

    def reply_all(self) -> None:
        for _ in range(10_000):
            if not self.asks:
                return
            self.reply()
        raise AssertionError("the reader asks without end")

    def codes(self) -> list[str]:
        return [remark.code for remark in self.remarks]


def test_a_block_in_order_leaves_in_the_same_call_without_a_question() -> None:
    bench = Bench()
    for seq in range(0, 64, 4):
        bench.send(block(seq, 4))
        assert bench.ledger.last(7) == seq + 3
    assert bench.asked == 0
    assert bench.order.counters.recovered == 0


def test_a_hole_is_filled_from_the_ring_and_later_blocks_wait_for_it() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.keep(block(1, 3))
    bench.send(block(4))
    assert bench.ledger.last(7) == 0
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 4)
    assert bench.ledger.lost(7) == 0
    assert bench.order.counters.recovered == 3


def test_what_the_ring_no_longer_has_is_reported_exactly() -> None:
    bench = Bench(capacity=256)
    bench.send(block(0))
    for seq in range(1, 1000):
        bench.keep(block(seq))
    bench.send(block(1000))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 1000)
    assert bench.ledger.lost(7) == 1000 - 256


def test_a_hole_in_the_ring_itself_is_reported() -> None:
    bench = Bench()
    bench.send(block(0, 5))
    bench.keep(block(8, 2))
    bench.send(block(12))
    bench.reply_all()
    assert bench.ledger.spans[7] == [
        (0, 4, False),
        (5, 7, True),
        (8, 9, False),
        (10, 11, True),
        (12, 12, False),
    ]


def test_one_who_joins_late_says_where_it_joined_and_loses_nothing() -> None:
    bench = Bench()
    bench.send(block(500))
    assert bench.codes() == ["JOINED"]
    assert bench.ledger.spans[7] == [(500, 500, False)]


def test_one_who_joins_late_gets_the_history_that_the_ring_has_and_no_gap_before_it() -> None:
    bench = Bench(SampleOrder(history=10_000), capacity=300)
    for seq in range(1000):
        bench.keep(block(seq))
    bench.send(block(1000))
    bench.reply_all()
    bench.ledger.assert_complete(7, 1001 - 300, 1000)
    assert bench.ledger.lost(7) == 0


def test_a_gap_within_the_head_of_a_restarted_device_is_reported_even_after_joining_late() -> None:
    bench = Bench(SampleOrder(history=10))
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(5000))
    bench.take(bench.order.on_token(7, 1, False))
    bench.take(bench.order.on_token(8, 2, True))
    bench.keep(block(3, 7, boot=8))
    bench.send(block(10, boot=8, start_ns=10**12))
    bench.reply_all()
    assert bench.ledger.spans[8] == [(0, 2, True), (3, 9, False), (10, 10, False)]


def test_a_reader_that_resumes_asks_for_all_since() -> None:
    bench = Bench(SampleOrder(resume_after=(7, 41)))
    bench.take(bench.order.on_token(7, 1, True))
    bench.take(bench.order.on_token(7, 0, False))
    bench.keep(block(0, 100))
    bench.send(block(100))
    bench.reply_all()
    bench.ledger.assert_complete(7, 42, 100)
    assert bench.ledger.lost(7) == 0


def test_a_reader_that_resumes_after_a_restart_gets_the_old_end_and_the_new_head() -> None:
    bench = Bench(SampleOrder(resume_after=(7, 41)))
    bench.keep(block(0, 60))
    bench.take(bench.order.on_token(8, 5, True))
    bench.take(bench.order.on_token(7, 0, False))
    bench.keep(block(0, 20, boot=8, start_ns=10**12))
    bench.send(block(20, boot=8, start_ns=10**12))
    bench.reply_all()
    bench.ledger.assert_complete(7, 42, 59)
    bench.ledger.assert_complete(8, 0, 20)
    assert bench.ledger.boots == [7, 8]


@pytest.mark.parametrize("sample_first", [False, True])
def test_a_restarted_device_loses_neither_its_old_end_nor_its_new_head(sample_first: bool) -> None:
    bench = Bench()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0, 10))
    bench.keep(block(10, 5))
    bench.keep(block(0, 4, boot=8, start_ns=10**12))
    if sample_first:
        bench.send(block(3, boot=8, start_ns=10**12))
    bench.take(bench.order.on_token(7, 1, False))
    bench.take(bench.order.on_token(8, 2, True))
    bench.send(block(4, boot=8, start_ns=10**12))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 14)
    bench.ledger.assert_complete(8, 0, 4)
    assert bench.ledger.lost(7) == bench.ledger.lost(8) == 0
    assert bench.codes() == ["JOINED", "SOURCE RESTARTED"]


def test_an_old_end_that_nobody_knows_is_a_gap_of_unknown_length() -> None:
    bench = Bench()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0, 10))
    bench.stores.clear()
    bench.take(bench.order.on_token(7, 1, False))
    bench.send(block(0, boot=8, start_ns=10**12))
    bench.reply_all()
    assert bench.ledger.unknown_ends == [7]
    bench.ledger.assert_complete(8, 0, 0)


def test_of_two_sources_the_first_keeps_control_until_it_is_gone() -> None:
    bench = Bench()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.take(bench.order.on_token(8, 2, True))
    bench.send(block(900, boot=8))
    assert bench.codes()[-1] == "DUPLICATE SOURCE"
    for seq in range(1, 10):
        bench.send(block(seq))
        bench.send(block(900 + seq, boot=8))
    assert 8 not in bench.ledger.spans
    assert bench.order.counters.foreign == 10
    assert bench.codes().count("DUPLICATE SOURCE") == 1
    bench.take(bench.order.on_token(7, 1, False))
    bench.send(block(910, boot=8))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 9)
    assert bench.ledger.spans[8] == [(900, 908, True), (909, 909, False), (910, 910, False)]


def test_a_rival_that_leaves_is_accounted_for() -> None:
    bench = Bench()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.take(bench.order.on_token(8, 2, True))
    bench.send(block(900, 4, boot=8))
    bench.send(block(1))
    bench.take(bench.order.on_token(8, 2, False))
    assert bench.ledger.spans[8] == [(900, 903, True)]


def test_one_who_joins_two_sources_follows_the_one_that_was_there_first() -> None:
    bench = Bench()
    bench.take(bench.order.on_token(8, 200, True))
    bench.take(bench.order.on_token(7, 100, True))
    bench.send(block(5, boot=8))
    bench.send(block(0, boot=7))
    assert bench.ledger.boots == [7]


def test_the_first_source_takes_control_back_when_its_successor_leaves() -> None:
    bench = Bench()
    for boot, since in ((7, 1), (8, 2)):
        bench.take(bench.order.on_token(boot, since, True))
    bench.send(block(0))
    bench.take(bench.order.on_token(7, 1, False))
    bench.send(block(0, boot=8))
    bench.reply_all()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(1))
    bench.send(block(1, boot=8))
    bench.take(bench.order.on_token(8, 2, False))
    bench.send(block(2))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 2)
    bench.ledger.assert_complete(8, 0, 1)
    assert bench.ledger.lost(7) == 1


def test_a_straggler_of_a_source_that_is_gone_is_no_conflict() -> None:
    bench = Bench()
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0, 5))
    bench.take(bench.order.on_token(7, 1, False))
    bench.take(bench.order.on_token(8, 2, True))
    bench.send(block(0, boot=8))
    bench.reply_all()
    bench.take(bench.order.on_block(block(3, 2)))
    bench.send(block(1, boot=8))
    assert "DUPLICATE SOURCE" not in bench.codes()
    assert bench.order.counters.duplicates == 2


def test_replayed_samples_of_long_ago_are_dropped() -> None:
    bench = Bench()
    bench.send(block(0, 3, start_ns=10**15))
    bench.take(bench.order.on_block(block(0, 3, boot=99)))
    bench.take(bench.order.on_block(block(0, 2, start_ns=10**15)))
    bench.send(block(3, start_ns=10**15))
    bench.ledger.assert_complete(7, 0, 3)
    assert bench.ledger.boots == [7]
    assert bench.order.counters.duplicates == 2
    assert bench.order.counters.foreign == 3


def test_an_unanswered_hole_is_given_up_after_some_tries_while_samples_come() -> None:
    bench = Bench(ring_replies=False)
    bench.take(bench.order.on_token(7, 1, True))
    bench.assert_gives_up_a_hole()


def test_a_patient_reader_asks_until_a_slow_ring_answers() -> None:
    bench = Bench(SampleOrder(patient=True), ring_replies=False)
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.keep(block(1, 4))
    bench.send(block(5))
    for seq in range(6, 6 + 4 * TRIES):
        bench.send(block(seq))
        bench.reply()
    bench.ring_replies = True
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 5 + 4 * TRIES)
    assert bench.losses == []


def test_a_patient_reader_asks_for_the_end_of_a_boot_while_the_next_one_sends() -> None:
    bench = Bench(SampleOrder(patient=True), ring_replies=False)
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.keep(block(1, 4))
    bench.take(bench.order.on_token(7, 1, False))
    bench.take(bench.order.on_token(8, 2, True))
    for seq in range(4 * TRIES):
        bench.send(block(seq, boot=8))
        bench.reply()
    bench.ring_replies = True
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 4)
    bench.ledger.assert_complete(8, 0, 4 * TRIES - 1)
    assert bench.losses == []


def test_a_patient_reader_gives_up_if_no_source_is_known() -> None:
    bench = Bench(SampleOrder(patient=True), ring_replies=False)
    bench.assert_gives_up_a_hole()


def test_a_patient_reader_gives_up_if_too_much_waits_behind_the_end_of_a_boot() -> None:
    bench = Bench(SampleOrder(capacity=4, patient=True), ring_replies=False)
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.take(bench.order.on_token(7, 1, False))
    bench.take(bench.order.on_token(8, 2, True))
    bench.send(block(0, 5, boot=8))
    for _ in range(TRIES):
        bench.reply()
    bench.ledger.assert_complete(8, 0, 4)
    assert bench.ledger.unknown_ends == [7]


def test_a_broken_link_is_waited_for_as_long_as_the_source_lives() -> None:
    bench = Bench(ring_replies=False)
    bench.take(bench.order.on_token(7, 1, True))
    bench.send(block(0))
    bench.send(block(5))
    for _ in range(50):
        bench.reply()
    assert bench.ledger.lost(7) == 0
    bench.keep(block(1, 4))
    bench.ring_replies = True
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 5)
    assert bench.ledger.lost(7) == 0


def test_too_many_samples_behind_a_hole_end_the_waiting() -> None:
    bench = Bench(SampleOrder(capacity=100), ring_replies=False)
    bench.send(block(0))
    for seq in range(5, 120):
        bench.send(block(seq))
    bench.ledger.assert_complete(7, 0, 119)
    assert bench.ledger.lost(7) == 4


def test_silence_brings_the_samples_that_were_missed_at_the_end() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.keep(block(1, 6))
    bench.take(bench.order.on_silence())
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 6)
    assert bench.ledger.lost(7) == 0


def test_a_reply_that_settles_nothing_is_no_endless_loop() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.send(block(9))
    ask = bench.asks.popleft()
    bench.take(bench.order.on_reply(ask, RingReply(7, ask.first - 1, ())))
    assert not bench.asks
    # The ring is asked after the sample was heard: what it has not seen by then was never sent.
    assert bench.order.counters.foreign == 1
    bench.send(block(1))
    bench.ledger.assert_complete(7, 0, 1)


@dataclass(frozen=True)
class Fate:
    """What happens to one block on its way, and to the reader's questions meanwhile."""

    length: int
    lost: bool
    copies: int
    delay: int
    replies: bool
    restart: bool


fates = st.lists(
    st.builds(
        Fate,
        length=st.integers(1, 5),
        lost=st.booleans(),
        copies=st.integers(1, 3),
        delay=st.integers(0, 6),
        replies=st.booleans(),
        restart=st.sampled_from([False] * 11 + [True]),
    ),
    min_size=1,
    max_size=60,
)


@settings(max_examples=200, deadline=None)
@given(fates=fates, capacity=st.integers(256, 400), shrink=st.booleans())
def test_every_sample_is_delivered_or_reported_once_and_in_order(
    fates: list[Fate], capacity: int, shrink: bool
) -> None:
    bench = Bench(SampleOrder(resume_after=(1, -1)), capacity=4 if shrink else capacity)
    boot, seq, sent = 1, 0, {1: 0}
    in_flight: list[tuple[int, SampleBlock]] = []
    bench.take(bench.order.on_token(1, 1, True))
    for now, fate in enumerate(fates):
        if fate.restart:
            bench.take(bench.order.on_token(boot, boot, False))
            boot, seq = boot + 1, 0
            bench.take(bench.order.on_token(boot, boot, True))
        part = bench.keep(block(seq, fate.length, boot, start_ns=10**12 * boot))
        seq += fate.length
        sent[boot] = seq
        if not fate.lost:
            in_flight += [(now + fate.delay * copy, part) for copy in range(fate.copies)]
        for _, arrived in [item for item in in_flight if item[0] <= now]:
            bench.take(bench.order.on_block(arrived))
        in_flight = [item for item in in_flight if item[0] > now]
        if fate.replies and bench.asks:
            bench.reply()
    bench.send(block(seq, 1, boot, start_ns=10**12 * boot))
    bench.reply_all()
    bench.take(bench.order.on_silence())
    bench.reply_all()
    heard = set(bench.ledger.spans)
    assert bench.ledger.boots == sorted(heard)
    for some in heard:
        last = seq if some == boot else sent[some] - 1
        bench.ledger.assert_complete(some, 0, last)
    counters = bench.order.counters
    assert counters.delivered == sum(bench.ledger.delivered(b) for b in heard)
    assert counters.lost == sum(bench.ledger.lost(b) for b in heard)
    if not shrink:
        assert counters.lost == 0


@settings(deadline=None)
@given(first=st.integers(-5, 5000), last=st.one_of(st.integers(-5, 5000), st.just(OPEN)))
def test_a_ring_settles_what_it_is_asked_and_invents_nothing(first: int, last: int) -> None:
    store = RingStore(block(0), 512)
    for seq in range(0, 3000, 3):
        store.add(block(seq, 2))
    reply = store.reply(Ask(7, first, last))
    assert reply.settled <= last
    numbers = [seq for part in reply.blocks for seq in range(part.seq, part.seq + len(part))]
    assert all(first <= seq <= reply.settled for seq in numbers)
    kept = range(2998 - 511, reply.settled + 1)
    assert numbers == [seq for seq in kept if seq % 3 < 2 and seq >= first]


def test_a_loss_of_unknown_length_does_not_count_as_samples() -> None:
    order = SampleOrder(resume_after=(7, 9))
    order.on_token(7, 0, False)
    outcomes = order.on_block(block(0, boot=8))
    ask = next(item for item in outcomes if isinstance(item, Ask))
    answered = order.on_reply(ask, RingReply(7, -1, ()))
    assert [item.last < item.first for item in answered if isinstance(item, Loss)] == [True]
    assert order.counters.lost == 0


@pytest.mark.parametrize("gone_first", [7, 8])
def test_a_rival_whose_token_returns_first_after_a_router_has_no_control(gone_first: int) -> None:
    bench = Bench()
    since = {7: 1, 8: 2}
    for boot in (7, 8):
        bench.order.on_token(boot, since[boot], True)
    bench.send(block(0, 10, boot=7))
    bench.send(block(0, 1, boot=8))
    for boot in (gone_first, 15 - gone_first):
        bench.take(bench.order.on_token(boot, since[boot], False))
    for boot in (8, 7):
        bench.take(bench.order.on_token(boot, since[boot], True))
    for seq in range(10, 60, 10):
        bench.send(block(seq, 10, boot=7))
        bench.reply_all()
    assert bench.order.position == (7, 59)
    bench.ledger.assert_complete(7, 0, 59)
