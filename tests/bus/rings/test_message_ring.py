"""A ring of messages keeps at least its capacity, and gives back what was put in, bit by bit."""

import random
import threading

from hypothesis import given, settings
from hypothesis import strategies as st

from rigwatch.wire.bus.message_ring import PACKED, RARE_BYTES, MessageRing, capacity_of
from rigwatch.wire.messages import ALARMS, ESTIMATES, MODELS
from rigwatch.wire.ordering import OPEN, UNKNOWN, Ask

RUN = 7


def everything(ring: MessageRing, first: int = 0) -> dict[int, bytes]:
    """All messages from `first` on, reply by reply."""
    found: dict[int, bytes] = {}
    while (reply := ring.reply(Ask(RUN, first, OPEN))).blocks:
        assert reply.settled == reply.blocks[-1].seq
        found |= {message.seq: message.payload for message in reply.blocks}
        first = reply.settled + 1
    return found


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.integers(0, 300), max_size=6 * PACKED),
    st.integers(1, 40_000),
    st.integers(0, 7 * PACKED),
)
def test_what_is_kept_is_the_newest_whole(sizes: list[int], capacity: int, first: int) -> None:
    ring = MessageRing(RUN, capacity)
    sent = [bytes([n % 251]) * size for n, size in enumerate(sizes)]
    for payload in sent:
        ring.add(payload)
    kept = everything(ring)
    assert list(kept) == list(range(len(sent) - len(kept), len(sent)))
    assert all(sent[number] == payload for number, payload in kept.items())
    older = sent[: len(sent) - len(kept)]
    if older:
        assert sum(map(len, kept.values())) + len(older[-1]) > capacity
    assert everything(ring, first) == {n: data for n, data in kept.items() if n >= first}


def test_a_question_is_answered_to_its_last_number_and_for_its_run_only() -> None:
    ring = MessageRing(RUN, 1 << 20)
    for number in range(5 * PACKED):
        assert ring.add(bytes([number % 251])).seq == number
    reply = ring.reply(Ask(RUN, PACKED - 2, PACKED + 2))
    assert [message.seq for message in reply.blocks] == list(range(PACKED - 2, PACKED + 3))
    assert ring.reply(Ask(RUN + 1, 0, OPEN)).settled == UNKNOWN
    assert ring.reply(Ask(RUN, 9 * PACKED, OPEN)).settled == 5 * PACKED - 1


def test_a_reply_is_as_it_was_asked_for_while_the_ring_moves_on() -> None:
    draw = random.Random(5)
    ring = MessageRing(RUN, 1 << 18)
    sent = [draw.randbytes(draw.randrange(200, 800)) for _ in range(60 * PACKED)]
    stop = threading.Event()

    def move_on() -> None:
        for payload in sent:
            ring.add(payload)
        stop.set()

    sender = threading.Thread(target=move_on)
    sender.start()
    asked = 0
    while not stop.is_set():
        reply = ring.reply(Ask(RUN, asked, OPEN))
        assert all(message.payload == sent[message.seq] for message in reply.blocks)
        asked = max(asked, reply.settled + 1)
    sender.join()
    assert asked


def test_rare_messages_fill_a_ring_within_days_not_within_a_year() -> None:
    assert capacity_of(ESTIMATES, 32 << 20) == 32 << 20
    assert capacity_of(ALARMS, 32 << 20) == capacity_of(MODELS, 32 << 20) == RARE_BYTES
    assert capacity_of(ALARMS, 1 << 10) == 1 << 10
