"""What comes for several rigs, or for one alone, is handed to the readers whose it is."""

from collections import deque
from functools import partial

from rigwatch.wire.bus.several.joint_message import join
from rigwatch.wire.bus.several.joint_receiver import (
    MOST_PASSED,
    WAITING,
    JointReceiver,
    Received,
    Share,
)


def following(channel: deque[Received]) -> Received | None:
    return channel.popleft() if channel else None


class Bench:
    """A receiver with its channel, and readers that note what they get."""

    def __init__(self) -> None:
        self.channel: deque[Received] = deque()
        self.receiver = JointReceiver(partial(following, self.channel))

    def reader(self, rig: str) -> tuple[Share, list[Received], deque[Received]]:
        heard: list[Received] = []
        alone: deque[Received] = deque()
        share = self.receiver.add(rig, lambda *one: heard.append(one), partial(following, alone))
        return share, heard, alone


def test_every_reader_of_a_rig_gets_what_is_its_own_with_the_senders_identity() -> None:
    bench = Bench()
    (a, of_a, _), (also_a, also_of_a, _), (b, of_b, _) = map(bench.reader, "aab")
    bench.channel += [
        (join([("a", b"1", b"first"), ("b", b"2", b"second"), ("c", b"", b"?")]), "one", b""),
        (join([("a", b"3", b"third")]), "other", b""),
    ]
    b.take()
    assert a.may_hold()
    assert also_a.may_hold()
    for share in (a, also_a):
        share.take()
    assert of_a == also_of_a == [(b"first", "one", b"1"), (b"third", "other", b"3")]
    assert of_b == [(b"second", "one", b"2")]


def test_a_reader_that_has_left_gets_nothing_and_the_others_go_on() -> None:
    bench = Bench()
    (left, of_left, _), (stays, of_stays, _) = map(bench.reader, "aa")
    left.undeclare()
    bench.channel.append((join([("a", b"", b"message")]), "one", b""))
    stays.take()
    left.take()
    assert (of_left, of_stays) == ([], [(b"message", "one", b"")])
    stays.undeclare()
    bench.channel.append((join([("a", b"", b"more")]), "one", b""))
    stays.take()
    assert len(of_stays) == 1


def test_of_too_many_that_wait_the_oldest_are_dropped() -> None:
    bench = Bench()
    slow, of_slow, _ = bench.reader("a")
    quick, _, _ = bench.reader("b")
    for number in range(WAITING + 10):
        bench.channel.append((join([("a", b"", str(number).encode())]), "one", b""))
        quick.take()
    slow.take()
    assert [int(payload) for payload, _, _ in of_slow] == [*range(10, WAITING + 10)]


def test_what_comes_alone_is_found_after_few_looks_and_then_at_each() -> None:
    share, heard, alone = Bench().reader("a")
    assert not any(share.may_hold() for _ in range(100))
    alone.append((b"first", "one", b""))
    assert any(share.may_hold() for _ in range(MOST_PASSED + 1))
    share.take()
    for number in range(5):
        alone.append((str(number).encode(), "one", b""))
        assert any(share.may_hold() for _ in range(2))
        share.take()
    assert [payload for payload, _, _ in heard] == [b"first", b"0", b"1", b"2", b"3", b"4"]


def test_what_is_no_joined_message_goes_to_one_reader_as_it_is() -> None:
    bench = Bench()
    (a, of_a, _), (b, of_b, _) = map(bench.reader, "ab")
    bench.channel.append((b"rubbish", "stranger", b""))
    b.take()
    a.take()
    assert (of_a, of_b) == ([], [(b"rubbish", "stranger", b"")])
