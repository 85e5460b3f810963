"""A damaged session gives what is intact and says what is lost; it never gives a wrong number."""

import struct
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import encode
from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.messages.message_types import Column, EstimateBlock, SampleBlock
from rigwatch.wire.session import Session, SessionWriter, open_session, run_info
from rigwatch.wire.session.chunks import MAGIC, Chunk, Damage, scan

BLOCK = 32
BLOCKS = 12
T0 = 1_700_000_000_000_000_000


def block(number: int) -> SampleBlock:
    index = np.arange(number * BLOCK, (number + 1) * BLOCK)
    values = np.random.default_rng(number).normal(size=BLOCK)
    column = Column("voltage", "V", values, np.zeros(BLOCK, np.uint8))
    return SampleBlock("rig", 7, number * BLOCK, index * 3906, T0 + index * 3906250, (column,))


@cache
def intact() -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with SessionWriter(path, run_info("bench1", 256.0, t_ns=T0)) as writer:
            for number in range(BLOCKS):
                writer.write(block(number))
                writer.flush()
        return path.read_bytes()


@cache
def chunk_spans() -> list[tuple[int, int]]:
    """Where the chunks of `intact` lie, the first of which holds no samples."""
    with TemporaryDirectory() as folder:
        path = write(Path(folder), intact())
        starts = [item.offset for item in scan(path) if isinstance(item, Chunk)]
    lengths = [struct.unpack_from("<Q", intact(), start + 1)[0] + 9 for start in starts]
    return [(start, start + length) for start, length in zip(starts, lengths, strict=True)]


def write(folder: Path, data: bytes) -> Path:
    path = folder / "damaged.mcap"
    path.write_bytes(data)
    return path


def delivered(session: Session) -> list[int]:
    """Sequence numbers of all samples delivered, each of which was compared with the original."""
    seen: list[int] = []
    for item in session.messages(["samples"]):
        found = item.message
        assert isinstance(found, SampleBlock)
        number, rest = divmod(found.seq, BLOCK)
        assert rest == 0
        assert encode(found) == encode(block(number))
        seen += range(found.seq, found.seq + len(found))
    return seen


def check(data: bytes, touched: set[int], folder: Path) -> None:
    """Whatever was done: intact chunks come, others are reported, or it is refused."""
    path = write(folder, data)
    try:
        session = open_session(path)
    except SessionError as error:
        refused(str(error), touched)
        return
    seen = delivered(session)
    for number, whole in enumerate(untouched(touched)[1:]):
        if whole:
            assert set(range(number * BLOCK, (number + 1) * BLOCK)) <= set(seen)
    assert len(seen) == BLOCK * BLOCKS or session.lost or session.unclosed
    assert len(seen) == len(set(seen))


def refused(text: str, touched: set[int]) -> None:
    """A refusal is one line, and due only where the magic or every chunk was hit."""
    assert "\n" not in text
    assert touched & set(range(8)) or not any(untouched(touched))


def untouched(touched: set[int]) -> list[bool]:
    return [not touched & set(range(*span)) for span in chunk_spans()]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 1 << 30), st.integers(0, 7)), min_size=1, max_size=8))
def test_bit_flips_anywhere(flips: list[tuple[int, int]]) -> None:
    data = bytearray(intact())
    for at, bit in flips:
        data[at % len(data)] ^= 1 << bit
    touched = {at % len(data) for at, _ in flips}
    with TemporaryDirectory() as folder:
        check(bytes(data), touched, Path(folder))


@pytest.mark.nightly
def test_a_flip_of_each_bit_of_every_record_head(tmp_path: Path) -> None:
    """The file's first record; a chunk in the middle: opcode, lengths, checksum, what is beside."""
    start, _ = chunk_spans()[5]
    for at in [*range(8, 17), *range(start - 40, start + 60)]:
        for bit in range(8):
            data = bytearray(intact())
            data[at] ^= 1 << bit
            check(bytes(data), {at}, tmp_path)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 1 << 30))
def test_truncation_anywhere(length: int) -> None:
    cut = length % (len(intact()) + 1)
    with TemporaryDirectory() as folder:
        check(intact()[:cut], set(range(cut, len(intact()))), Path(folder))


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 1 << 30), st.binary(max_size=200), st.integers(0, 3000))
def test_bytes_replaced_by_others(at: int, garbage: bytes, dropped: int) -> None:
    first = 8 + at % (len(intact()) - 8)
    data = intact()[:first] + garbage + intact()[first + dropped :]
    with TemporaryDirectory() as folder:
        touched = set(range(first, first + max(1, dropped)))
        check(data, touched, Path(folder))


@pytest.mark.parametrize("beyond", [0, 1, 9, 30, 57, 100, 5000])
def test_a_head_that_claims_to_be_longer_hides_no_chunk(tmp_path: Path, beyond: int) -> None:
    data = bytearray(intact())
    first_with_samples, _ = chunk_spans()[1]
    data[9:17] = struct.pack("<Q", first_with_samples + beyond - 17)
    check(bytes(data), set(range(9, 17)), tmp_path)


def test_a_lost_span_says_where_and_between_which_times(tmp_path: Path) -> None:
    start, end = chunk_spans()[4]
    data = bytearray(intact())
    data[(start + end) // 2] ^= 0xFF
    session = open_session(write(tmp_path, bytes(data)))
    assert len(delivered(session)) == BLOCK * (BLOCKS - 1)
    (span,) = session.lost
    assert (span.offset, span.file.name) == (start, "damaged.mcap")
    assert span.after_ns == block(2).t_ns[0]
    assert span.before_ns == block(4).t_ns[0]
    assert "chunk" in span.reason


def test_the_head_may_be_lost(tmp_path: Path) -> None:
    start, end = chunk_spans()[0]
    data = bytearray(intact())
    data[(start + end) // 2] ^= 0xFF
    session = open_session(write(tmp_path, bytes(data)))
    assert len(delivered(session)) == BLOCK * BLOCKS
    with pytest.raises(SessionError, match=r"the description of the run \(RunInfo\) is lost"):
        assert session.info


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "the file is empty"),
        (b"time,voltage\n0,1\n", "not an MCAP file"),
        (MAGIC, "holds no message of rigwatch"),
        (b"\x89MCAP1\r\n" + b"x" * 100, "MCAP version '1', this rigwatch reads version '0'"),
    ],
)
def test_what_is_no_session_is_refused(tmp_path: Path, content: bytes, complaint: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(SessionError, match=complaint) as error:
        open_session(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_and_an_empty_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="no such file or folder"):
        open_session(tmp_path / "none")
    with pytest.raises(SessionError, match="a folder without session segments"):
        open_session(tmp_path)
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "1.mcap").write_bytes(intact())
    with pytest.raises(SessionError, match="did you mean the folder inner in it"):
        open_session(tmp_path)


def foreign(path: Path, topic: str, metadata: dict[str, str]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start()
        number = writer.register_schema(
            "rigwatch.SampleBlock", "protobuf", schema.file_descriptor_set()
        )
        channel = writer.register_channel(topic, "protobuf", number, metadata)
        writer.add_message(channel, T0, encode(block(0)), T0)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_a_foreign_recording_is_refused_with_its_topics(tmp_path: Path) -> None:
    path = foreign(tmp_path / "f.mcap", "/camera", {})
    with pytest.raises(SessionError, match="holds no message of rigwatch: its topics are /camera"):
        open_session(path)


def test_a_later_format_is_refused(tmp_path: Path) -> None:
    path = foreign(tmp_path / "f.mcap", "samples", {"rigwatch_format": "2"})
    with pytest.raises(SessionError, match="session format 2, this rigwatch reads up to 1"):
        open_session(path)


def test_an_empty_segment_does_not_cost_the_others(tmp_path: Path) -> None:
    (tmp_path / "000001.mcap").write_bytes(intact())
    (tmp_path / "000002.mcap").write_bytes(b"")
    session = open_session(tmp_path)
    assert len(delivered(session)) == BLOCK * BLOCKS
    assert [span.reason for span in session.lost] == [
        "the file is empty, expected a session (MCAP)"
    ]


def test_blocks_that_do_not_fit_are_an_error_and_no_numbers(tmp_path: Path) -> None:
    """Checksums right, content wrong: written by something else, never guessed at."""
    ragged = EstimateBlock("rig", 7, 0, np.arange(3), (Column("a", "", np.zeros(2)),))
    with SessionWriter(tmp_path / "a.mcap", run_info("bench1", 256.0)) as writer:
        writer.write(ragged)
    session = open_session(tmp_path / "a.mcap")
    with pytest.raises(SessionError, match="columns"):
        list(session.estimates())


def test_scan_says_the_same_whoever_asks(tmp_path: Path) -> None:
    data = bytearray(intact())
    data[chunk_spans()[3][0] + 60] ^= 1
    path = write(tmp_path, bytes(data))
    assert sum(isinstance(item, Damage) for item in scan(path)) == 1
