"""Chunks and index of a file are those of the library, and take few bytes of memory meanwhile."""

import tracemalloc
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from rigwatch.wire.messages import Event
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.wire.session import chunk_writer as chunks_written
from rigwatch.wire.session.chunk_writer import ChunkWriter, chunk_writer

NEVER = 1 << 62


def plain(out: BytesIO) -> Writer:
    return Writer(out, NEVER, CompressionType.ZSTD, enable_data_crcs=True)


def written(made: Callable[[BytesIO], Writer]) -> bytes:
    out, random = BytesIO(), np.random.default_rng(1)
    writer = made(out)
    writer.start()
    channels = [writer.register_channel(name, "json", 0) for name in "abc"]
    writer.flush()
    for number in range(50):
        for _ in range(int(random.integers(0, 6))):
            channel, t_ns = channels[int(random.integers(3))], int(random.integers(1 << 62))
            writer.add_message(channel, t_ns, bytes(int(random.integers(9000))), number)
        writer.flush()
    writer.add_message(channels[0], 5, b"not flushed before the end", 5)
    writer.finish()
    return out.getvalue()


def test_the_file_is_that_of_the_library_to_the_byte() -> None:
    assert isinstance(chunk_writer(BytesIO()), ChunkWriter)
    assert written(chunk_writer) == written(plain)


def test_a_library_of_another_shape_is_used_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks_written, "_NAMES", ("stream", "a_name_of_another_version"))
    assert type(chunk_writer(BytesIO())) is Writer
    assert written(chunk_writer) == written(plain)


def test_the_chunk_of_a_recorder_that_was_held_up_leaves_nothing_with_the_process() -> None:
    writer, random = chunk_writer(BytesIO()), np.random.default_rng(1)
    writer.start()
    channel = writer.register_channel("a", "json", 0)
    kept = []
    for size in (22_000, 22_000, 300_000, 22_000):
        writer.add_message(channel, 1, random.bytes(size), 1)
        writer.flush()
        kept.append(chunks_written._compressor.memory_size())
    assert kept[-1] == kept[1] > 0


def test_a_chunk_takes_few_bytes_of_memory_until_the_file_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    chunks = 2000
    with SessionWriter(path, run_info("r", 256.0, t_ns=1), sync=False) as writer:
        tracemalloc.start()
        for number in range(chunks):
            writer.write(Event("daq", number, "info", "CODE", ""))
            writer.flush()
        taken = tracemalloc.get_traced_memory()[0] / chunks
        tracemalloc.stop()
    assert taken < 150.0
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == chunks + 1
