"""Writes one MCAP file: every flush is one or two checksummed chunks, synced to the disk, or more
where they would be too large to be read.

    magic, header
    chunk  schemas, channels, RunInfo
    chunk  samples between two flushes, merged into one block
    chunk  estimates, merged into one block, and everything else between these flushes
    …
    end    checksum of everything before it
    summary, magic                          only if the file was closed; a killed one ends with its
                                            last chunk

Channel numbers are the positions in the table of topics, so that a file whose first chunk is
damaged can still be read.
"""

import time
from pathlib import Path
from types import TracebackType
from typing import Self

from rigwatch.version import __version__
from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import (
    TOPICS,
    EstimateBlock,
    Message,
    RunInfo,
    SampleBlock,
    encode,
)
from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.session.chunk_writer import chunk_writer
from rigwatch.wire.session.chunks import LARGEST_CHUNK
from rigwatch.wire.session.file_output import FileOutput
from rigwatch.wire.session.merging import LARGEST_BLOCK, by_chunk, merge_pending

PROFILE = "rigwatch"
FORMAT = 1
"""Version of the content: readers refuse a higher one."""
FORMAT_KEY = "rigwatch_format"
SOFTWARE = f"rigwatch {__version__}"
SPILL = 2 * LARGEST_BLOCK
"""Most waiting samples before an automatic flush."""
FULL = LARGEST_CHUNK // 8
"""Size of messages with which a chunk ends: readers refuse one that is far larger [bytes]."""
_CHANNEL_IDS = {line.message: number for number, line in enumerate(TOPICS, start=1)}


def message_time(message: Message) -> int:
    """Time of the message, or of its first sample [ns]."""
    if isinstance(message, SampleBlock | EstimateBlock):
        return int(message.t_ns[0]) if len(message) else 0
    return message.t_ns


class SessionWriter:
    """One session file being written.

    `write` buffers; `flush` merges the buffered messages, writes them at once and waits for the
    disk: `send` and then `settle`, which may be called in another thread. After a failure the file
    is unchanged, `pending` holds the unwritten messages, and the writer is closed.

    Args:
        path: the file; it must not exist.
        run: written at its head.
        sync: whether each flush waits for the disk.

    Raises:
        SessionError: the file exists or cannot be written.
    """

    def __init__(self, path: Path | str, run: RunInfo, *, sync: bool = True) -> None:
        self.path = Path(path)
        self.pending: list[Message] = []
        self._waiting = self._sent = 0
        self._output = FileOutput(self.path, sync)
        self._mcap = chunk_writer(self._output)
        try:
            self._head(run)
        except SessionError:
            self.abandon()
            self.path.unlink(missing_ok=True)
            raise

    def _head(self, run: RunInfo) -> None:
        self._mcap.start(profile=PROFILE, library=SOFTWARE)
        metadata = {FORMAT_KEY: str(FORMAT)}
        for line in TOPICS:
            name = schema.type_name(line.message)
            number = self._mcap.register_schema(name, "protobuf", schema.file_descriptor_set())
            self._mcap.register_channel(line.name, "protobuf", number, metadata)
        self.write(run)
        self.flush()

    @property
    def size(self) -> int:
        """Number of bytes on the disk."""
        return self._output.committed

    def write(self, message: Message) -> None:
        """Buffer the message; it is on the disk after the next flush."""
        self.pending.append(message)
        if isinstance(message, SampleBlock | EstimateBlock):
            self._waiting += len(message)
            if self._waiting >= SPILL:
                self.flush()

    def flush(self) -> None:
        """Write all buffered messages to the disk.

        Raises:
            SessionError: the disk is full, gone or read-only. `pending` still holds the messages.
        """
        self.send()
        self.settle()

    def send(self) -> None:
        """Write all buffered messages to the file; they are on the disk after `settle`.

        Raises:
            SessionError: as in `flush`.
        """
        if self._sent:
            self.settle()
        if not self.pending and not self._output.waiting:
            return
        for chunk in by_chunk(merge_pending(self.pending)):
            size = 0
            for message in chunk:
                size += self._add(message)
                if size >= FULL:
                    self._mcap.flush()  # type: ignore[no-untyped-call]
                    size = 0
            self._mcap.flush()  # type: ignore[no-untyped-call]
        self._output.send()
        self._sent, self._waiting = len(self.pending), 0

    def settle(self) -> None:
        """Wait until what was sent is on the disk.

        Raises:
            SessionError: as in `flush`.
        """
        self._output.settle()
        del self.pending[: self._sent]
        self._sent = 0

    def _add(self, message: Message) -> int:
        """Put a message into the present chunk; its size [bytes]."""
        t_ns, data = max(0, message_time(message)), encode(message)
        self._mcap.add_message(_CHANNEL_IDS[type(message)], t_ns, data, t_ns)
        return len(data)

    def close(self) -> None:
        """Write the rest and the index, and close the file.

        Raises:
            SessionError: as in `flush`.
        """
        if self._output.closed:
            return
        try:
            self.flush()
            self._mcap.finish()  # type: ignore[no-untyped-call]
            self._output.commit()
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Close the file without an index; what was flushed stays on the disk."""
        self._output.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()


def run_info(
    rig: str,
    sample_rate_hz: float,
    *,
    t_ns: int | None = None,
    notes: str = "",
    configuration: str = "",
    configuration_sha256: str = "",
) -> RunInfo:
    """A `RunInfo` signed by this version; `t_ns` is the current time if not given [ns]."""
    began = time.time_ns() if t_ns is None else t_ns
    return RunInfo(rig, began, sample_rate_hz, configuration, configuration_sha256, SOFTWARE, notes)
