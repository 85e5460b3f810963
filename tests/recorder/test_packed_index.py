"""An open file keeps its index in few bytes, and closes as the library would close it."""

import tracemalloc
from io import BytesIO
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer

from rigwatch.wire.messages import Event
from rigwatch.wire.session import SessionWriter, run_info
from rigwatch.wire.session.packed_index import PackedIndex


def written(packed: bool) -> bytes:
    out = BytesIO()
    writer = Writer(out)
    if packed:
        PackedIndex.put_into(writer)
    writer.start()
    channels = [writer.register_channel(name, "json", 0) for name in "ab"]
    for number in range(50):
        for channel in channels[: 1 + number % 2]:
            writer.add_message(channel, number, bytes([number]), number)
        writer.flush()
    writer.finish()
    return out.getvalue()


def test_the_file_is_that_of_the_library_to_the_byte() -> None:
    assert written(packed=True) == written(packed=False)


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
