"""Frames survive the line, and nothing that is not a frame comes out as one."""

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.wire.device import frame as wire
from rigwatch.wire.device.frame import Frame, FrameDecoder
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
    first, second, third = (wire.encode(frame) for frame in numbered(3))
    flipped = bytearray(second)
    flipped[-3] ^= 0x40
    decoder = FrameDecoder()
    assert len(decoder.feed(first + bytes(flipped) + third)) == 2
    assert (decoder.crc_errors, decoder.skipped_bytes, decoder.resyncs) == (1, len(second) - 1, 1)


def test_another_version_is_refused() -> None:
    encoded = bytearray(wire.encode(Frame(1, 1, 1, (1,))))
    body = wire._unstuff(bytes(encoded[:-1]))
    changed = b"\x02" + body[1:-4]
    payload = changed + wire._CRC.pack(zlib.crc32(changed))
    with pytest.raises(FrameError, match="version 2, expected 1"):
        wire.decode(wire._stuff(payload))


@pytest.mark.parametrize(
    "frame", [Frame(1, 1, 1, ()), Frame(2**32, 1, 1, (1,)), Frame(1, 1, 1, (32768,))]
)
def test_what_does_not_fit_is_refused(frame: Frame) -> None:
    with pytest.raises(FrameError):
        wire.encode(frame)
