"""Who reads one topic does not unpack the others, and gets what a reader of everything gets."""

from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import NonSeekingReader
from mcap.writer import Writer

from rigwatch.wire.messages import (
    SAMPLES,
    AlarmCommand,
    Column,
    EstimateBlock,
    Message,
    SampleBlock,
    encode,
)
from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.session import LostSpan, SessionWriter, open_session, run_info
from rigwatch.wire.session.chunks import Chunk, Damage, scan
from rigwatch.wire.session.file_index import FileIndex, file_index
from rigwatch.wire.session.selected_chunks import selected_chunks

BLOCK, BLOCKS = 32, 12
STEP_NS = 3_906_250
RUN = run_info("bench1", 256.0, t_ns=1)
SAMPLES_CHANNEL = 1


def samples(number: int) -> SampleBlock:
    index = np.arange(number * BLOCK, (number + 1) * BLOCK)
    values = np.random.default_rng(number).normal(size=BLOCK)
    column = Column("voltage", "V", values, np.zeros(BLOCK, np.uint8))
    return SampleBlock("rig", 7, int(index[0]), index * 3906, index * STEP_NS, (column,))


def estimates(number: int) -> EstimateBlock:
    index = np.arange(number * BLOCK, (number + 1) * BLOCK)
    column = Column("theta1", "", np.random.default_rng(-number % 99).normal(size=BLOCK))
    return EstimateBlock("rig", 7, int(index[0]), index * STEP_NS, (column,))


def command(number: int) -> AlarmCommand:
    return AlarmCommand("*", "reset", "anna", number * BLOCK * STEP_NS)


def written(path: Path) -> None:
    """Flushes of samples and estimates, one with a command between them."""
    with SessionWriter(path, RUN) as writer:
        for number in range(BLOCKS):
            writer.write(samples(number))
            writer.write(estimates(number))
            if number == 4:
                writer.write(command(number))
            writer.flush()


@cache
def intact() -> bytes:
    with TemporaryDirectory() as folder:
        written(Path(folder) / "a.mcap")
        return (Path(folder) / "a.mcap").read_bytes()


def index_of(path: Path) -> FileIndex:
    found = file_index(path)
    assert found is not None
    return found


def read_apart(path: Path) -> tuple[list[Message], list[Message], tuple[LostSpan, ...]]:
    """Samples and estimates, each read alone, and what the first reading lists as lost."""
    session = open_session(path)
    first = [item.message for item in session.messages(["samples"])]
    lost = session.lost
    return first, [item.message for item in open_session(path).messages(["estimates"])], lost


def read_together(path: Path) -> tuple[list[Message], list[Message], tuple[LostSpan, ...]]:
    """The same from one pass through all messages, which knows no index."""
    session = open_session(path)
    found = [item.message for item in session.messages()]
    return (
        [message for message in found if isinstance(message, SampleBlock)],
        [message for message in found if isinstance(message, EstimateBlock)],
        session.lost,
    )


def check_alike(data: bytes) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        path.write_bytes(data)
        apart, together = read_apart(path), read_together(path)
    for alone, among_all in zip(apart[:2], together[:2], strict=True):
        assert list(map(encode, alone)) == list(map(encode, among_all))
    assert apart[2] == together[2]


def test_samples_and_estimates_of_a_flush_lie_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    index = index_of(path)
    estimated = set(index.channel.tolist()) - {SAMPLES_CHANNEL}
    found = list(selected_chunks(path, index, estimated))
    assert all(isinstance(item, Chunk) for item in found)
    # One of them is that with the command, which holds estimates, too.
    assert len(found) == BLOCKS
    every = [item.offset for item in scan(path) if isinstance(item, Chunk)]
    assert len(every) == 1 + 2 * BLOCKS - 1
    assert [begin for begin, _ in index.spans.tolist()] == every


def test_a_command_stays_between_the_blocks_of_its_flush(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with SessionWriter(path, RUN) as writer:
        for message in (samples(0), estimates(0), command(1), samples(1), estimates(1)):
            writer.write(message)
    kinds = [type(item.message).__name__ for item in open_session(path).messages()]
    blocks = ["SampleBlock", "EstimateBlock"]
    assert kinds == ["RunInfo", *blocks, "AlarmCommand", *blocks]


def test_other_tools_find_every_checksum_right() -> None:
    reader = NonSeekingReader(BytesIO(intact()), validate_crcs=True)
    assert len(list(reader.iter_messages())) == 1 + 2 * BLOCKS + 1


def test_whole_files_are_read_alike() -> None:
    check_alike(intact())


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(17, 1 << 30), st.integers(0, 7)), min_size=1, max_size=4))
def test_damaged_files_are_read_alike(flips: list[tuple[int, int]]) -> None:
    data = bytearray(intact())
    for at, bit in flips:
        data[17 + at % (len(data) - 17)] ^= 1 << bit
    check_alike(bytes(data))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 1 << 30), st.binary(max_size=60), st.integers(0, 4000))
def test_files_with_other_bytes_in_them_are_read_alike(at: int, other: bytes, gone: int) -> None:
    data = intact()
    at = 4000 + at % (len(data) - 4000)
    check_alike(data[:at] + other + data[at + gone :])


def test_damage_to_what_is_passed_over_is_listed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    index = index_of(path)
    hit = [row for row, number in enumerate(index.channel) if number not in (-1, SAMPLES_CHANNEL)]
    begin, end = index.spans[hit[3]].tolist()
    data = bytearray(path.read_bytes())
    data[end - 5] ^= 1
    path.write_bytes(data)
    session = open_session(path)
    assert sum(map(len, session.samples())) == BLOCK * BLOCKS
    following = int(index.spans[hit[3] + 1][0])
    assert [(span.offset, span.size) for span in session.lost] == [(begin, following - begin)]
    items = list(selected_chunks(path, index, set()))
    assert [item.offset for item in items if isinstance(item, Damage)] == [begin, 0]


def foreign(change: Callable[[Writer], None], **options: bool) -> bytes:
    """A closed file by the library, with `change` between two chunks of samples."""
    out = BytesIO()
    writer = Writer(out, **options)
    writer.start()
    name = schema.type_name(SampleBlock)
    kind = writer.register_schema(name, "protobuf", schema.file_descriptor_set())
    channel = writer.register_channel(SAMPLES.name, "protobuf", kind)
    for number in range(2):
        writer.add_message(channel, number, encode(samples(number)), number)
        writer.flush()
        if number == 0:
            change(writer)
    writer.finish()
    return out.getvalue()


@pytest.mark.parametrize(
    ("data", "known"),
    [
        (foreign(lambda _: None, enable_data_crcs=True), True),
        (foreign(lambda _: None), False),
        (foreign(lambda to: to.add_metadata("a", {"b": "c"}), enable_data_crcs=True), False),
        (foreign(lambda _: None, enable_data_crcs=True, use_statistics=False), False),
    ],
    ids=["whole", "no checksum", "more than chunks", "chunks not counted"],
)
def test_an_index_is_trusted_only_if_nothing_can_lie_beside_it(
    tmp_path: Path, data: bytes, known: bool
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    assert (file_index(path) is not None) == known
    assert sum(map(len, open_session(path).samples())) == 2 * BLOCK


def test_a_session_that_is_still_written_has_no_index(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with SessionWriter(path, RUN) as writer:
        writer.write(samples(0))
        writer.write(estimates(0))
        writer.flush()
        assert file_index(path) is None
        assert sum(map(len, open_session(path).samples())) == BLOCK
