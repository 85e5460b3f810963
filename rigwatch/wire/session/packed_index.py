"""Index of the chunks of a file being written, kept as the bytes that will stand at its end.

The MCAP writer keeps an object for each chunk until the file is closed, 640 bytes of memory; a
recorder writes up to five chunks a second and rig. As bytes it is a sixth.
"""

from collections.abc import Iterator
from typing import Self

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.writer import Writer


class PackedIndex:
    """Stands for the writer's list of chunk indexes, to which it appends and which it writes."""

    def __init__(self) -> None:
        self._records = bytearray()

    @classmethod
    def put_into(cls, writer: Writer) -> None:
        """Replace the list of a new writer; one of another shape, with no such list, is left."""
        name = "_Writer__chunk_indices"
        if getattr(writer, name, None) == []:
            setattr(writer, name, cls())

    def append(self, index: ChunkIndex) -> None:
        """Keep what `index` writes."""
        record = RecordBuilder()
        index.write(record)
        self._records += record.end()  # type: ignore[no-untyped-call]

    def __iter__(self) -> Iterator[Self]:
        yield self

    def write(self, stream: RecordBuilder) -> None:
        """Write all records at once."""
        stream.write(self._records)
