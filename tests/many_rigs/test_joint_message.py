"""Messages of several rigs as one message: nothing is lost, and nothing is made of other bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.bus.several.burst import Burst
from rigwatch.wire.bus.several.joint_message import Part, join, size_of, split
from rigwatch.wire.bus.several.joint_sender import LARGEST, Among, JointSender
from rigwatch.wire.errors import MessageError

IDS = st.text("abcXYZ019_-", min_size=1, max_size=12)
PARTS = st.lists(st.tuples(IDS, st.binary(max_size=16), st.binary(max_size=40)), max_size=8)


class HeardLine:
    """A key at which somebody listens, or nobody."""

    def __init__(self, *, heard: bool = True) -> None:
        self.is_heard = heard
        self.sent: list[bytes] = []

    def put(self, payload: bytes, mark: bytes) -> None:
        self.sent.append(mark + payload)


@given(PARTS)
def test_what_was_joined_is_found_again(parts: list[Part]) -> None:
    assert split(join(parts)) == parts


@given(PARTS, st.data())
def test_a_message_that_is_cut_or_too_long_is_refused(
    parts: list[Part], data: st.DataObject
) -> None:
    whole = join(parts)
    cut = data.draw(st.integers(0, len(whole) - 1))
    for wrong in (whole[:cut], whole + b"x"):
        with pytest.raises(MessageError):
            split(wrong)


@given(st.binary(max_size=64))
def test_any_bytes_are_messages_or_refused(data: bytes) -> None:
    try:
        parts = split(data)
    except MessageError:
        return
    assert join(parts) == data


def test_rigs_are_joined_in_the_order_of_their_messages_up_to_the_largest_size() -> None:
    line, burst = HeardLine(), Burst()
    sender = JointSender(line, burst)
    parts = [(f"rig{number % 5}", b"mark", bytes([number]) * 3000) for number in range(40)]
    with burst.held():
        for part in parts:
            sender.add(part)
    assert [part for one in line.sent for part in split(one)] == parts
    assert len(line.sent) == 3
    assert max(map(len, line.sent)) <= LARGEST + 2
    burst.close()


def test_a_rigs_own_key_is_used_only_where_somebody_listens() -> None:
    for heard in (False, True):
        own, alone, joint, burst = HeardLine(heard=heard), HeardLine(), HeardLine(), Burst()
        outlet = Among("a", own, alone, JointSender(joint, burst), burst)
        with burst.held():
            outlet.put(b"payload", b"mark")
        assert own.sent == ([b"markpayload"] if heard else [])
        assert [split(one) for one in joint.sent] == [[("a", b"mark", b"payload")]]
        assert alone.sent == []
        burst.close()


def test_nothing_is_joined_where_no_process_of_several_rigs_listens() -> None:
    own, alone, joint, burst = HeardLine(), HeardLine(), HeardLine(heard=False), Burst()
    outlet = Among("a", own, alone, JointSender(joint, burst), burst)
    with burst.held():
        outlet.put(b"payload", b"")
    assert (own.sent, alone.sent, joint.sent) == ([b"payload"], [], [])
    burst.close()


def test_a_message_too_large_to_be_joined_is_sent_alone() -> None:
    own, alone, joint, burst = HeardLine(heard=False), HeardLine(), HeardLine(), Burst()
    outlet = Among("a", own, alone, JointSender(joint, burst), burst)
    large = bytes(LARGEST + 1 - size_of(("a", b"m", b"")))
    with burst.held():
        outlet.put(large, b"m")
        outlet.put(large[1:], b"m")
    assert alone.sent == [b"m" + large]
    assert [split(one) for one in joint.sent] == [[("a", b"m", large[1:])]]
    burst.close()
