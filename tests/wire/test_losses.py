"""What `rigwatch info` says is missing: every loss once, whoever reported it, and no other."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.messages import Column, Gap, SampleBlock
from rigwatch.wire.session.losses import Losses, count, union, without

numbers = st.integers(0, 60)
spans = st.lists(st.tuples(numbers, numbers).map(lambda pair: (min(pair), max(pair))), max_size=8)


def samples(first: int, last: int) -> SampleBlock:
    n = last - first + 1
    column = Column("voltage", "V", np.zeros(n))
    return SampleBlock("rig", 7, first, np.zeros(n, np.int64), np.zeros(n, np.int64), (column,))


def gap(first: int, last: int, reporter: str, topic: str = "") -> Gap:
    return Gap("rig", 7, first, last, 0, reporter, "", topic)


def as_set(found: list[tuple[int, int]]) -> set[int]:
    return {n for first, last in found for n in range(first, last + 1)}


@given(spans, spans)
def test_spans_are_sets_of_numbers(some: list[tuple[int, int]], others: list[tuple[int, int]]):
    assert as_set(union(some)) == as_set(some)
    left = without(union(some), union(others))
    assert as_set(left) == as_set(some) - as_set(others)
    assert count(left) == len(as_set(left))


def test_a_loss_that_three_readers_report_is_one_and_one_that_was_recovered_is_none():
    losses = Losses()
    losses.add(samples(0, 99))
    losses.add(samples(200, 299))
    for reporter in ("monitor", "recorder", "dashboard"):
        losses.add(gap(100, 199, reporter))
    losses.add(gap(250, 260, "monitor"))  # the recorder got them
    losses.add(gap(300, 349, "monitor"))  # nothing follows them
    losses.add(gap(350, 349, "recorder"))
    assert losses.missing() == [(100, 199), (300, 349)]
    assert losses.unknown_ends == 1


def test_messages_are_missing_where_the_recorder_missed_them():
    losses = Losses()
    losses.add(gap(3, 5, "recorder", "alarms"))
    losses.add(gap(3, 9, "dashboard", "alarms"))
    losses.add(gap(10, 9, "recorder", "estimates"))
    assert losses.messages == {"alarms": 3, "estimates": 0}
    assert losses.missing() == []
