"""Frames survive the line, and nothing that is not a frame comes out as one."""

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.device import frame as wire
from rigwatch.wire.device.frame import ChecksumError, Frame, FrameDecoder
from rigwatch.wire.errors import FrameError

U32 = st.integers(0, 2**32 - 1)
FRAMES = st.builds(
    Frame, U32, U32, U32, st.lists(st.integers(-32768, 32767), min_size=1, max_size=8).map(tuple)
)


def test_layout_is_the_one_in_the_docstring() -> None:
    encoded = wire.encode(Frame(0x04030201, 0x08070605, 0x0C0B0A09, (1, -1)))
    payload = bytes([1, *range(1, 13), 1, 0, 255, 255])
    crc = zlib.crc32(payload).to_bytes(4, "little")
    assert encoded == bytes([15]) + payload[:14] + b"\x07\xff\xff" + crc + b"\0"
    assert len(wire.encode(Frame(1, 2, 3, (4, 5, 6)))) == 25


@given(st.lists(FRAMES, max_size=12), st.lists(st.integers(1, 40), min_size=1))
def test_frames_come_back_however_the_bytes_are_cut(frames: list[Frame], cuts: list[int]) -> None:
    stream = b"".join(wire.encode(frame) for frame in frames)
    decoder, out, at, turn = FrameDecoder(), [], 0, 0
    while at < len(stream):
        step = cuts[turn % len(cuts)]
        out += decoder.feed(stream[at : at + step])
        at, turn = at + step, turn + 1
    assert out == frames
    losses = (decoder.crc_errors, decoder.skipped_bytes, decoder.resyncs)
    assert (decoder.good, losses) == (len(frames), (0, 0, 0))


def numbered(count: int) -> list[Frame]:
    return [Frame(7, seq, 3906 * seq, (seq, -seq, 0)) for seq in range(count)]


def flipped(frame: Frame) -> bytes:
    """A frame on the line whose checksum was hit."""
    line = bytearray(wire.encode(frame))
    line[-3] ^= 0x40
    return bytes(line)


def checked(body: bytes) -> bytes:
    """A payload whose checksum is right, framed."""
    payload = body + zlib.crc32(body).to_bytes(4, "little")
    return b"".join(bytes((len(part) + 1,)) + part for part in payload.split(b"\0"))


EDITS = st.lists(
    st.tuples(
        st.sampled_from(["flip", "drop", "insert", "repeat"]),
        st.floats(0, 1, exclude_max=True),
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=12,
)


def edited(stream: bytes, edits: list[tuple[str, float, int]]) -> bytes:
    line = bytearray(stream)
    for kind, where, value in edits:
        at = int(where * len(line))
        if kind == "flip":
            line[at] ^= value or 1
        elif kind == "drop":
            del line[at : at + 1 + value % 30]
        elif kind == "insert":
            line[at:at] = bytes([value]) * (1 + value % 7)
        else:
            line[at:at] = line[at : at + value % 60]
    return bytes(line)


@given(EDITS)
def test_no_corruption_yields_a_frame_that_was_not_sent(
    edits: list[tuple[str, float, int]],
) -> None:
    sent = numbered(20)
    decoder = FrameDecoder()
    received = decoder.feed(edited(b"".join(map(wire.encode, sent)), edits))
    assert set(received) <= set(sent)
    assert decoder.good == len(received)


@given(st.integers(0, 24), st.integers(1, 255), st.binary(max_size=60))
def test_one_disturbance_costs_at_most_two_frames(at: int, flip: int, inserted: bytes) -> None:
    sent = numbered(12)
    lines = [bytearray(wire.encode(frame)) for frame in sent]
    lines[5][at % len(lines[5])] ^= flip
    lines[5][at:at] = inserted
    received = FrameDecoder().feed(b"".join(lines))
    assert set(sent) - set(received) <= {sent[5], sent[6]}


@given(st.lists(st.binary(max_size=400), max_size=10))
def test_garbage_is_counted_whole_and_never_accepted(pieces: list[bytes]) -> None:
    decoder = FrameDecoder()
    assert not [frame for piece in pieces for frame in decoder.feed(piece)]
    decoder.forget()
    garbage = b"".join(pieces)
    assert decoder.skipped_bytes == len(garbage) - garbage.count(0)


def test_counters_tell_a_checksum_from_framing() -> None:
    first, second, third = numbered(3)
    line = flipped(second)
    decoder = FrameDecoder()
    assert len(decoder.feed(wire.encode(first) + line + wire.encode(third))) == 2
    assert (decoder.crc_errors, decoder.skipped_bytes, decoder.resyncs) == (1, len(line) - 1, 1)


def test_another_version_is_refused() -> None:
    with pytest.raises(FrameError, match=r"^frame version 2, expected 1$"):
        wire.decode(checked(bytes([2, *range(1, 15)])))


@pytest.mark.parametrize(
    ("frame", "why"),
    [
        (Frame(1, 1, 1, ()), "1 to 64 channels, found 0"),
        (Frame(1, 1, 1, (0,) * 65), "1 to 64 channels, found 65"),
        (Frame(2**32, 1, 1, (1,)), "does not fit the frame"),
        (Frame(1, 1, 1, (32768,)), "does not fit the frame"),
    ],
)
def test_what_does_not_fit_is_refused(frame: Frame, why: str) -> None:
    with pytest.raises(FrameError, match=why):
        wire.encode(frame)


def test_as_many_channels_as_a_frame_holds_come_back() -> None:
    frame = Frame(1, 2, 3, tuple(range(-1, 63)))
    assert FrameDecoder().feed(wire.encode(frame)) == [frame]


@pytest.mark.parametrize("size", [0, 13, 14, 16, 143, 145])
def test_a_length_that_no_frame_has_is_refused_though_its_checksum_is_right(size: int) -> None:
    with pytest.raises(FrameError, match=rf"^{size + 4} bytes are no frame$"):
        wire.decode(checked(bytes([1] * size)))


@pytest.mark.parametrize("encoded", [b"\x02\x01", b"\x04\x01\x01\x01"])
def test_fewer_bytes_than_a_checksum_are_refused(encoded: bytes) -> None:
    with pytest.raises(FrameError, match="bytes are no frame"):
        wire.decode(encoded)


@pytest.mark.parametrize("encoded", [b"\x02\x01\x00\x01", b"\x01\x05\x01"])
def test_counts_that_point_nowhere_are_refused(encoded: bytes) -> None:
    with pytest.raises(FrameError, match=r"^COBS counts do not fit the frame$"):
        wire.decode(encoded)


def test_a_wrong_checksum_is_called_so() -> None:
    encoded = bytearray(checked(bytes([1] * 15)))
    encoded[-1] ^= 0x40
    with pytest.raises(ChecksumError, match=r"^the CRC-32 of a frame does not match$"):
        wire.decode(bytes(encoded))


def test_counters_add_up_over_disturbances() -> None:
    first, *sent = numbered(4)
    bad = flipped(first)
    decoder = FrameDecoder()
    for frame in sent:
        assert decoder.feed(bad + wire.encode(frame)) == [frame]
    losses = (decoder.crc_errors, decoder.skipped_bytes, decoder.resyncs)
    assert (decoder.good, losses) == (3, (3, 3 * (len(bad) - 1), 3))


def test_a_single_foreign_byte_is_a_disturbance() -> None:
    (frame,) = numbered(1)
    decoder = FrameDecoder()
    decoder.feed(b"\x07\0" + wire.encode(frame))
    assert (decoder.skipped_bytes, decoder.resyncs) == (1, 1)


def test_noise_without_an_end_takes_little_memory_and_is_counted_while_it_lasts() -> None:
    (frame,) = numbered(1)
    decoder = FrameDecoder()
    for _ in range(100):
        decoder.feed(b"\x55" * 10)
    assert 800 < decoder.skipped_bytes < 1000
    assert decoder.feed(b"\0" + wire.encode(frame)) == [frame]
    assert (decoder.skipped_bytes, decoder.resyncs) == (1000, 1)


def test_after_a_closed_line_the_rest_of_a_frame_is_forgotten() -> None:
    first, second, third = numbered(3)
    decoder = FrameDecoder()
    decoder.feed(wire.encode(first)[:9])
    decoder.forget()
    assert decoder.feed(wire.encode(second)) == [second]
    assert (decoder.skipped_bytes, decoder.resyncs) == (9, 1)
    decoder.forget()
    assert decoder.feed(wire.encode(third)) == [third]
    assert decoder.resyncs == 1, "nothing was cut off"


def test_closing_the_line_does_not_hide_an_earlier_disturbance() -> None:
    first, second = numbered(2)
    decoder = FrameDecoder()
    decoder.feed(flipped(first))
    decoder.forget()
    decoder.feed(wire.encode(second))
    assert decoder.resyncs == 1
