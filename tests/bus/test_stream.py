"""What waits behind a gap is found without a search among all of it."""

from rigwatch.wire.ordering import Numbered
from rigwatch.wire.ordering.ring_protocol import OPEN
from rigwatch.wire.ordering.stream import Stream

MANY = 4096


class Counted(int):
    """A number that counts how often it is compared."""

    comparisons = 0

    def __lt__(self, other: int) -> bool:
        Counted.comparisons += 1
        return int(self) < int(other)

    __hash__ = int.__hash__


def test_a_reader_that_is_behind_does_not_search_all_that_waits_for_each_block() -> None:
    stream: Stream[Numbered] = Stream(1, 0)
    Counted.comparisons = 0
    for seq in range(MANY, 0, -1):
        stream.hold(Numbered(1, Counted(seq), b""))
        assert stream.first_waiting() == seq
    assert [stream.take().seq for _ in range(MANY)] == list(range(1, MANY + 1))
    assert Counted.comparisons < 40 * MANY
    assert stream.first_waiting() == OPEN


def test_what_was_dropped_does_not_come_back_in_the_place_of_what_waits_now() -> None:
    stream: Stream[Numbered] = Stream(1, 0)
    for seq in (5, 7, 6, 7):
        stream.hold(Numbered(1, seq, b""))
    assert stream.samples_waiting == 3
    stream.drop_waiting()
    assert stream.first_waiting() == OPEN
    assert stream.samples_waiting == 0
    for seq in (7, 9):
        stream.hold(Numbered(1, seq, b"again"))
    assert [stream.take().seq, stream.take().seq] == [7, 9]
    assert stream.first_waiting() == OPEN
