"""Frames that are read in one call are those that the decoder reads one by one, for any bytes."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.adapters import frame_run
from daq.adapters.serial_line import SerialAdapter
from rigwatch.wire.device import Frame, FrameDecoder, encode
from rigwatch.wire.errors import DeviceError

CHANNELS = 3
U32 = st.integers(0, 2**32 - 1)
CODES = st.lists(st.integers(-32768, 32767), min_size=CHANNELS, max_size=CHANNELS).map(tuple)
FRAMES = st.builds(Frame, st.sampled_from([0, 7, 2**32 - 1]), U32, U32, CODES)
Row = tuple[int, int, int, tuple[int, ...]]


class Line:
    """Gives the bytes of one piece after another."""

    def __init__(self, pieces: list[bytes]) -> None:
        self.pieces = pieces

    def open(self) -> None:
        """Nothing to open."""

    def read(self, timeout: float) -> bytes:
        """The next piece."""
        return self.pieces.pop(0)

    def close(self) -> None:
        """Nothing to close."""


def read(pieces: list[bytes]) -> tuple[list[Row], Mapping[str, float]]:
    line = Line(list(pieces))
    adapter = SerialAdapter(line, CHANNELS, lambda: 5)
    rows: list[Row] = []
    while line.pieces:
        for block in adapter.read(0.0):
            assert block.arrived_ns.tolist() == [5] * len(block)
            numbers = zip(block.seq.tolist(), block.device_us.tolist(), strict=True)
            for (seq, us), codes in zip(numbers, block.codes.tolist(), strict=True):
                rows.append((block.boot, seq, us, tuple(codes)))
    return rows, adapter.counters()


def decoded(pieces: list[bytes]) -> tuple[list[Row], Mapping[str, float]]:
    decoder = FrameDecoder()
    frames = [frame for piece in pieces for frame in decoder.feed(piece)]
    return [(one.boot, one.seq, one.device_us, one.codes) for one in frames], {
        "bytes": sum(map(len, pieces)),
        "good_frames": decoder.good,
        "crc_errors": decoder.crc_errors,
        "skipped_bytes": decoder.skipped_bytes,
        "resyncs": decoder.resyncs,
    }


@given(
    st.lists(FRAMES, max_size=12),
    st.lists(st.integers(1, 200), min_size=1, max_size=6),
    st.lists(st.tuples(st.integers(0, 300), st.integers(0, 255)), max_size=3),
)
def test_rows_and_counts_are_the_decoders_with_bytes_changed_and_cut_anywhere(
    frames: list[Frame], cuts: list[int], changes: list[tuple[int, int]]
) -> None:
    stream = bytearray(b"".join(map(encode, frames)))
    for at, value in changes:
        if stream:
            stream[at % len(stream)] = value
    pieces, at = [], 0
    while at < len(stream):
        step = cuts[len(pieces) % len(cuts)]
        pieces.append(bytes(stream[at : at + step]))
        at += step
    expected = decoded(pieces)
    if all(len(codes) == CHANNELS for _, _, _, codes in expected[0]):
        assert read(pieces) == expected


def test_intact_frames_of_one_boot_are_read_in_one_call() -> None:
    frames = [Frame(7, seq, 3906 * seq, (seq, -seq, 0)) for seq in range(9)]
    run = frame_run.read_run(b"".join(map(encode, frames))[:-1], CHANNELS, 5)
    assert run is not None
    assert run.seq.tolist() == list(range(9))
    assert run.codes[8].tolist() == [8, -8, 0]


def test_a_device_of_other_channels_is_refused_as_before() -> None:
    four = encode(Frame(7, 1, 2, (1, 2, 3, 4)))
    with pytest.raises(DeviceError, match="sends 4 channels, the configuration has 3"):
        read([four])


def test_frames_of_two_boots_become_two_blocks() -> None:
    mixed = [Frame(7, 1, 2, (1, 2, 3)), Frame(8, 0, 0, (4, 5, 6))]
    rows, _ = read([b"".join(map(encode, mixed))])
    assert [row[0] for row in rows] == [7, 8]
