"""What a reader says of samples it could not deliver, whom it follows, and how often it asks."""

from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigwatch.wire.messages import SampleBlock
from rigwatch.wire.ordering import OPEN, UNKNOWN, Ask, Numbered, RingReply
from rigwatch.wire.ordering.outcomes import FORGED, POSITION_WRONG, Loss, Remark
from rigwatch.wire.ordering.sample_order import LARGEST_SEQ, SUSPECT, TRIES, SampleOrder
from tests.bus.samples import block, is_intact
from tests.bus.test_sample_order import Bench

LATER = 10**12
OTHER_CONTROL = "another source had control"


def tokens(bench: Bench, *boots: int) -> None:
    """Sources are there, the first for longest."""
    for boot in boots:
        bench.take(bench.order.on_token(boot, boot, True))


def gone(bench: Bench, boot: int) -> None:
    bench.take(bench.order.on_token(boot, boot, False))


def restarted(end: int) -> Bench:
    """Boot 7 has delivered samples up to `end`, boot 8 its first; the end of 7 is asked for."""
    bench = Bench()
    tokens(bench, 7)
    bench.send(block(0, end + 1))
    gone(bench, 7)
    tokens(bench, 8)
    bench.send(block(0, boot=8, start_ns=LATER))
    assert list(bench.asks) == [Ask(7, end + 1, OPEN)]
    return bench


# ---- whom it follows ------------------------------------------------------------------------


def test_joining_is_reported_with_boot_and_number() -> None:
    bench = Bench()
    bench.send(block(500))
    assert bench.remarks == [Remark("info", "JOINED", "joined boot 7 at seq 500")]


def test_history_before_the_first_sample_of_a_boot_is_not_asked_for() -> None:
    bench = Bench(SampleOrder(history=10))
    bench.send(block(4))
    assert list(bench.asks) == [Ask(7, 0, 3)]


def test_another_source_is_refused_in_words_and_takes_over_with_a_warning() -> None:
    bench = Bench()
    tokens(bench, 7, 8)
    bench.send(block(0))
    bench.send(block(900, 3, boot=8))
    assert bench.remarks[-1] == Remark(
        "error",
        "DUPLICATE SOURCE",
        "boot 8 sends samples too; boot 7 came first and keeps control",
    )
    bench.send(block(1))
    gone(bench, 7)
    assert bench.remarks[-1] == Remark("warning", "SOURCE RESTARTED", "boot 8 has control now")
    assert bench.losses == [Loss(8, 900, 902, OTHER_CONTROL)]
    assert bench.order.sources.current == 8


def test_a_rival_that_leaves_was_lost_to_the_source_in_control() -> None:
    bench = Bench()
    tokens(bench, 7, 8)
    bench.send(block(0))
    bench.send(block(900, 4, boot=8))
    bench.send(block(1))
    gone(bench, 8)
    assert bench.losses == [Loss(8, 900, 903, OTHER_CONTROL)]
    assert bench.order.counters.lost == 4


def test_a_source_without_a_token_takes_over_once_the_other_is_silent() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.send(block(5, 2, boot=8, start_ns=LATER))
    assert bench.ledger.boots == [7]
    bench.take(bench.order.on_silence())
    bench.reply_all()
    bench.send(block(7, boot=8, start_ns=LATER))
    bench.reply_all()
    bench.ledger.assert_complete(8, last=7)
    assert bench.codes() == ["JOINED", "SOURCE RESTARTED"]


def test_a_source_that_comes_back_before_its_end_was_reported_continues_where_it_was() -> None:
    bench = restarted(end=4)
    bench.keep(block(5, 3))
    tokens(bench, 7)
    gone(bench, 8)
    bench.send(block(8))
    bench.reply_all()
    bench.send(block(9))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 9)
    bench.ledger.assert_complete(8, 0, 0)
    assert bench.order.counters.lost == 0
    assert bench.order.counters.duplicates == 0


def test_a_source_that_comes_back_after_its_end_was_reported_is_not_read_again() -> None:
    bench = restarted(end=4)
    bench.reply_all()
    gone(bench, 8)
    tokens(bench, 7)
    bench.send(block(5))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 5)
    assert bench.order.counters.lost == 0


def said(run: int, number: int) -> Numbered:
    return Numbered(run, number, b"")


def test_a_listener_follows_who_is_there_from_its_first_message_on() -> None:
    order: SampleOrder[Numbered] = SampleOrder()
    order.on_token(7, 1, True)
    assert said(7, 3) in order.on_block(said(7, 3))
    order.on_token(8, 2, True)
    assert order.follow(8) == [], "the other one lives"
    order.on_token(7, 1, False)
    assert order.follow(7) == [], "it is followed already"
    told = order.follow(8)
    assert told == [
        Remark("warning", "SOURCE RESTARTED", "boot 8 has control now"),
        Ask(7, 4, OPEN),
    ]
    order.on_reply(Ask(7, 4, OPEN), RingReply(7, 3, ()))
    assert order.on_block(said(8, 1)) == [Ask(8, 0, 0)]
    found = order.on_reply(Ask(8, 0, 0), RingReply(8, 0, (said(8, 0),)))
    assert found == [said(8, 0), said(8, 1)]
    assert order.on_block(said(8, 0)) == [], "it was heard already"


def test_one_who_has_heard_nobody_follows_the_first_that_is_there() -> None:
    order: SampleOrder[Numbered] = SampleOrder()
    order.on_token(1, 2, True)
    order.follow(1)
    assert order.position == (1, -1)
    assert order.on_block(said(1, 0)) == [said(1, 0)]


# ---- what is counted ------------------------------------------------------------------------


def test_strangers_are_foreign_and_stragglers_duplicates_and_they_add_up() -> None:
    bench = restarted(end=4)
    bench.reply_all()
    for part in (block(0, 2), block(3, 2)):
        bench.take(bench.order.on_block(part))
    assert bench.order.counters.duplicates == 4
    for part in (block(0, 1, boot=99), block(5, 2)):
        bench.take(bench.order.on_block(part))
    assert bench.order.counters.foreign == 3


def test_what_comes_twice_or_overlaps_is_counted_by_samples() -> None:
    bench = Bench()
    bench.send(block(0, 4))
    bench.send(block(2, 4))
    bench.send(block(0, 3))
    assert bench.order.counters.duplicates == 5
    assert bench.order.counters.delivered == 6


def test_the_largest_number_that_is_believed() -> None:
    bench = Bench()
    bench.take(bench.order.on_block(block(LARGEST_SEQ - 2, 2)))
    assert bench.order.position == (7, LARGEST_SEQ - 1)
    bench.take(bench.order.on_block(block(LARGEST_SEQ - 1, 2)))
    bench.take(bench.order.on_block(block(LARGEST_SEQ, 3)))
    assert bench.order.counters.foreign == 5


def test_an_empty_block_reports_nothing() -> None:
    bench = Bench()
    assert bench.order.on_block(block(3, 0)) == []
    assert bench.order.position is None


def test_recovered_samples_add_up_over_the_blocks_of_a_reply() -> None:
    bench = Bench()
    bench.send(block(0))
    for part in (block(1, 2), block(4, 3)):
        bench.keep(part)
    bench.send(block(8))
    bench.reply_all()
    assert bench.order.counters.recovered == 5
    assert bench.losses == [
        Loss(7, 3, 3, "the ring no longer has them"),
        Loss(7, 7, 7, "the ring no longer has them"),
    ]


def test_a_ring_that_says_more_than_was_asked_is_taken_at_the_question() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.send(block(4))
    ask = bench.asks.popleft()
    bench.take(bench.order.on_reply(ask, RingReply(7, 6, (block(1, 6),))))
    assert bench.order.position == (7, 4)
    assert bench.order.counters.recovered == 3
    bench.send(block(5, 2))
    bench.ledger.assert_complete(7, 0, 6)


def test_a_ring_that_replies_with_later_samples_only_has_lost_the_hole() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.send(block(5))
    ask = bench.asks.popleft()
    bench.take(bench.order.on_reply(ask, RingReply(7, 9, (block(8, 2),))))
    assert bench.losses == [Loss(7, 1, 4, "the ring no longer has them")]
    bench.ledger.assert_complete(7, 0, 5)


def test_a_sample_that_comes_while_the_ring_is_asked_counts_though_the_ring_has_lost_it() -> None:
    bench = Bench()
    for seq in (0, 10, 5):
        bench.send(block(seq))
    ask = bench.asks.popleft()
    bench.take(bench.order.on_reply(ask, RingReply(7, 9, ())))
    reason = "the ring no longer has them"
    assert bench.losses == [Loss(7, 1, 4, reason), Loss(7, 6, 9, reason)]
    bench.ledger.assert_complete(7, 0, 10)


def test_the_reply_to_another_question_is_ignored() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.send(block(5))
    assert bench.order.on_reply(Ask(7, 1, 2), RingReply(7, 2, ())) == []
    bench.keep(block(1, 4))
    bench.reply_all()
    assert bench.order.counters.lost == 0


# ---- who is asked how often -----------------------------------------------------------------


def test_silence_before_the_first_sample_asks_nobody() -> None:
    assert Bench().order.on_silence() == []


def test_silence_asks_once_and_the_reader_goes_on_if_nothing_was_missed() -> None:
    bench = Bench()
    bench.send(block(0))
    bench.take(bench.order.on_silence())
    assert list(bench.asks) == [Ask(7, 1, OPEN)]
    assert bench.order.on_silence() == []
    bench.reply()
    bench.send(block(1))
    assert bench.order.position == (7, 1)
    assert bench.order.counters.lost == 0


def test_a_silent_ring_after_silence_loses_nothing() -> None:
    bench = Bench(ring_replies=False)
    bench.send(block(0))
    for _ in range(2 * TRIES):
        bench.take(bench.order.on_silence())
        bench.reply()
    bench.send(block(1))
    bench.ledger.assert_complete(7, 0, 1)


def test_every_hole_is_asked_for_as_often_as_the_first() -> None:
    order: SampleOrder = SampleOrder()
    order.on_block(block(0))
    seq = 5
    for _ in range(3):
        first = order.position[1] + 1 if order.position else 0
        ask = Ask(7, first, seq - 1)
        assert ask in order.on_block(block(seq))
        for _ in range(TRIES - 1):
            seq += 1
            order.on_block(block(seq))
            assert order.on_reply(ask, None) == [ask]
        outcomes = order.on_reply(ask, None)
        assert outcomes[0] == Loss(7, ask.first, ask.last, "no source could be queried for them")
        assert order.position == (7, seq)
        seq += 5


def test_an_answer_makes_the_reader_patient_again() -> None:
    bench = Bench()
    bench.send(block(0))
    seq = 5
    for _ in range(TRIES):
        bench.send(block(seq))
        bench.ring_replies = False
        for _ in range(TRIES - 1):
            seq += 1
            bench.send(block(seq))
            bench.reply()
        bench.ring_replies = True
        bench.keep(block(seq - TRIES - 3, 4))
        bench.reply_all()
        seq += 5
    assert bench.order.counters.lost == 0


def test_capacity_counts_only_what_waits_now() -> None:
    bench = Bench(SampleOrder(capacity=100))
    bench.send(block(0))
    for seq in (2, 63, 124):
        bench.keep(block(seq - 1))
        bench.send(block(seq, 60))
        assert bench.order.counters.lost == 0
        bench.reply_all()
    bench.ledger.assert_complete(7, 0, 183)
    assert bench.losses == []


def test_capacity_counts_a_block_that_waits_twice_once() -> None:
    bench = Bench(SampleOrder(capacity=100))
    bench.send(block(0))
    for n in (30, 60, 60, 20):
        bench.send(block(2, n))
    bench.send(block(62, 40))
    assert bench.losses == []
    bench.send(block(102))
    assert bench.losses == [Loss(7, 1, 1, "too many samples waited behind them")]
    assert bench.order.position == (7, 102)


def test_too_many_waiting_samples_give_up_one_hole_and_keep_asking_for_the_next() -> None:
    bench = Bench(SampleOrder(capacity=100))
    bench.send(block(0))
    bench.send(block(2))
    bench.send(block(4, 100))
    assert bench.losses == [Loss(7, 1, 1, "too many samples waited behind them")]
    assert bench.order.position == (7, 2)
    assert bench.asks[-1] == Ask(7, 3, 3)
    bench.keep(block(3))
    bench.reply_all()
    assert bench.order.position == (7, 103)
    assert len(bench.losses) == 1


def test_history_before_a_resumed_position_is_taken_as_far_as_the_ring_has_it() -> None:
    bench = Bench(SampleOrder(resume_after=(7, 41), history=10), capacity=16)
    tokens(bench, 7)
    bench.keep(block(0, 52))
    bench.send(block(52))
    assert list(bench.asks) == [Ask(7, 32, 51)]
    bench.reply_all()
    bench.ledger.assert_complete(7, 37, 52)
    assert bench.losses == []


def test_the_end_of_a_boot_that_the_ring_does_not_know_is_lost_with_its_reason() -> None:
    bench = restarted(end=4)
    bench.take(bench.order.on_reply(bench.asks.popleft(), RingReply(7, UNKNOWN, ())))
    assert bench.losses == [Loss(7, 5, 4, "the source has restarted since")]
    assert bench.order.position == (8, 0)


@pytest.mark.parametrize("there", [False, True])
def test_another_ring_that_does_not_know_a_sending_boot_is_not_believed(there: bool) -> None:
    bench = Bench()
    if there:
        tokens(bench, 7)
    bench.send(block(0))
    bench.keep(block(1, 4))
    bench.send(block(5))
    for _ in range(TRIES - 1):
        ask = bench.asks.popleft()
        bench.take(bench.order.on_reply(ask, RingReply(7, UNKNOWN, ())))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 5)
    assert bench.losses == []


def test_a_stranger_that_is_silent_does_not_take_over_when_all_tokens_vanish() -> None:
    bench = Bench()
    tokens(bench, 7)
    bench.send(block(0, 4))
    bench.take(bench.order.on_block(block(0, boot=8)))
    bench.send(block(4, 4))
    bench.take(bench.order.on_token(7, 7, False))
    assert bench.order.sources.current == 7
    bench.take(bench.order.on_token(7, 7, True))
    bench.send(block(8, 4))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 11)
    assert bench.losses == []


def test_a_source_without_a_token_takes_over_when_it_goes_on_sending() -> None:
    bench = Bench()
    tokens(bench, 7)
    bench.send(block(0, 4))
    bench.send(block(0, boot=8))
    bench.send(block(4, 4))
    bench.take(bench.order.on_token(7, 7, False))
    bench.send(block(1, boot=8))
    assert bench.order.sources.current == 8


def test_the_end_of_a_boot_is_asked_for_until_nothing_more_comes() -> None:
    bench = restarted(end=9)
    ask = bench.asks.popleft()
    bench.take(bench.order.on_reply(ask, RingReply(7, 12, (block(10, 3),))))
    assert list(bench.asks) == [Ask(7, 13, OPEN)]
    bench.take(bench.order.on_reply(bench.asks.popleft(), RingReply(7, 12, ())))
    bench.ledger.assert_complete(7, 0, 12)
    assert bench.ledger.boots == [7, 8]


def test_a_straggler_behind_a_hole_at_the_end_of_a_boot_is_not_dropped() -> None:
    bench = restarted(end=9)
    bench.take(bench.order.on_block(block(12)))
    bench.take(bench.order.on_reply(bench.asks.popleft(), RingReply(7, 9, ())))
    assert list(bench.asks) == [Ask(7, 10, 11)]
    bench.keep(block(10, 2))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 12)
    assert bench.order.counters.lost == 0


# ---- what is not believed -------------------------------------------------------------------


def test_forged_samples_are_dropped_counted_and_reported_each_time() -> None:
    bench = Bench(SampleOrder(capacity=10))
    bench.send(block(0, 5))
    for seq in (50, 60):
        bench.take(bench.order.on_block(block(seq, 3)))
        bench.reply_all()
    assert bench.order.counters.foreign == 6
    text = "samples of boot 7 that its source never sent; they are dropped"
    assert bench.remarks[1:] == [Remark("error", FORGED, text)] * 2
    bench.send(block(6, 10))
    assert bench.order.counters.lost == 0, "ten may wait"
    bench.keep(block(5))
    bench.reply_all()
    bench.ledger.assert_complete(7, 0, 15)


def test_a_position_beyond_the_newest_sample_is_set_back_to_it() -> None:
    bench = Bench(SampleOrder(resume_after=(7, 20), capacity=10))
    tokens(bench, 7)
    bench.keep(block(0, 20))
    bench.take(bench.order.on_silence())
    bench.reply_all()
    told = "sample 20 of boot 7 lies beyond its newest, 19; reading continues from there"
    assert bench.remarks == [Remark("error", POSITION_WRONG, told)]
    assert bench.losses == [Loss(7, 20, 19, "the resume position was wrong")]
    bench.send(block(20))
    bench.send(block(22, 10))
    assert len(bench.losses) == 1, "ten may wait"
    bench.keep(block(21))
    bench.reply_all()
    bench.ledger.assert_complete(7, 20, 31)


def hear_old(bench: Bench, count: int) -> None:
    for _ in range(count):
        bench.take(bench.order.on_block(block(0)))


def test_old_samples_alone_make_the_reader_ask_now_and_then() -> None:
    bench = Bench(SampleOrder(resume_after=(7, 10**6)), ring_replies=False)
    tokens(bench, 7)
    for _ in range(2):
        hear_old(bench, SUSPECT - 1)
        assert not bench.asks
        hear_old(bench, 1)
        assert list(bench.asks) == [Ask(7, 10**6 + 1, OPEN)]
        bench.reply()
    hear_old(bench, 2 * SUSPECT)
    assert len(bench.asks) == 1, "one question at a time"


def test_a_fresh_sample_ends_the_suspicion() -> None:
    bench = Bench()
    bench.send(block(0, 4))
    for seq in range(4, 4 + 2 * SUSPECT):
        bench.take(bench.order.on_block(block(0, 3)))
        bench.send(block(seq))
    hear_old(bench, SUSPECT - 1)
    assert not bench.asks
    hear_old(bench, 1)
    assert len(bench.asks) == 1


# ---- the short way -------------------------------------------------------------------------


class StepByStep(SampleOrder[SampleBlock]):
    """Takes no short way for a block that simply follows the last one."""

    def goes_on(self, block: SampleBlock) -> bool:
        return False


BOOTS = st.sampled_from([7, 7, 8])
EVENTS = st.one_of(
    st.tuples(st.just("block"), BOOTS, st.sampled_from([0, 0, -4, -2, 3]), st.integers(0, 3)),
    st.tuples(st.just("block"), BOOTS, st.just(0), st.just(1)),
    st.tuples(st.just("token"), BOOTS, st.booleans()),
    st.tuples(st.just("reply"), st.integers(-1, 3)),
    st.tuples(st.just("silence")),
)


@example([("block", 7, 0, 1), ("block", 7, 3, 1), ("block", 7, -4, 3)], False)
@settings(max_examples=300)
@given(st.lists(EVENTS, min_size=10, max_size=60), st.booleans())
def test_a_block_that_simply_follows_is_treated_as_by_all_steps(
    events: list[tuple[Any, ...]], patient: bool
) -> None:
    orders: list[SampleOrder[SampleBlock]] = [
        one(capacity=8, patient=patient) for one in (SampleOrder, StepByStep)
    ]
    nexts, asked = {7: 0, 8: 0}, [Ask(7, 0, OPEN)]
    for kind, *rest in events:
        if kind == "block":
            boot, ahead, count = rest
            sent = block(max(0, nexts[boot] + ahead), count, boot)
            nexts[boot] = max(nexts[boot], sent.seq + count)
            found = [order.on_block(sent) for order in orders]
        elif kind == "token":
            found = [order.on_token(rest[0], rest[0], rest[1]) for order in orders]
        elif kind == "reply":
            ask = asked[-1]
            kept = block(ask.first, rest[0], ask.boot) if rest[0] > 0 else None
            reply = RingReply(ask.boot, ask.first + rest[0] - 1, (kept,)) if kept else None
            found = [order.on_reply(ask, reply) for order in orders]
        else:
            found = [order.on_silence() for order in orders]
        quick, careful = ([_plain(one) for one in some] for some in found)
        assert quick == careful
        assert orders[0].counters == orders[1].counters
        assert orders[0].position == orders[1].position
        asked += [one for one in found[0] if isinstance(one, Ask)]


def _plain(outcome: Any) -> Any:
    if not isinstance(outcome, SampleBlock):
        return outcome
    return outcome.boot, outcome.seq, len(outcome), is_intact(outcome)
