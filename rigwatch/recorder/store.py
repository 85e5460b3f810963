"""Writes a session in segments; messages wait in memory while the disk cannot be written.

    add → waiting (bounded, oldest dropped and counted) → flush → segment 000001.mcap, 000002.mcap,
    …

A flush has three steps, for callers that have several stores: `send` writes, `sync` waits for the
disk, in any thread, and `settle` tells what came of it.

If the disk is full, gone or read-only, messages wait in memory and the store retries once a second,
in a new segment. These faults are not raised but returned as events.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path

from rigwatch.wire.errors import SessionError, reason_of
from rigwatch.wire.messages import EstimateBlock, Event, Message, RunInfo, SampleBlock, Severity
from rigwatch.wire.session import SessionWriter, merge_pending, segment_name

SOURCE = "recorder"
RAM_BYTES = 64 << 20
"""Memory for waiting messages, enough for about a quarter of an hour [bytes]."""
COMPACTED = 256
"""Length of the blocks into which waiting samples are merged [samples]."""
RETRY_AFTER = 1.0
"""Time between write attempts [s]."""
_PLAIN_MESSAGE = 500
_PER_VALUE, _PER_COUNTER = 9, 100


def weight(message: Message) -> int:
    """Approximate memory of a message [bytes]."""
    if isinstance(message, SampleBlock):
        return _PLAIN_MESSAGE + len(message) * _PER_VALUE * (len(message.channels) + 2)
    if isinstance(message, EstimateBlock):
        return _PLAIN_MESSAGE + len(message) * _PER_VALUE * (len(message.columns) + 1)
    values = (getattr(message, one.name) for one in fields(message))
    return _PLAIN_MESSAGE + sum(_weight_of(value) for value in values)


def _weight_of(value: object) -> int:
    """That of a field, if it is a text or the counters of a process [bytes]."""
    if isinstance(value, Mapping):
        return sum(_PER_COUNTER + len(name) for name in value)
    return len(value) if isinstance(value, str) else 0


class Store:
    """One session folder being written; `now` is monotonic time [s] throughout.

    Args:
        folder: the session's folder, created with the first segment.
        run: description written at the head of each segment.
        segment: length of a segment [s].
        ram_bytes: memory for waiting messages [bytes].

    Attributes:
        samples: samples on the disk.
        dropped_samples: samples dropped because the disk was unavailable for too long.
        dropped_messages: other messages dropped.
        segment_count: number of segments of the session that were started.
        failure: why the disk cannot be written, empty otherwise.
    """

    def __init__(
        self, folder: Path, run: RunInfo, segment: float, ram_bytes: int = RAM_BYTES
    ) -> None:
        self.folder = folder
        self.samples = self.dropped_samples = self.dropped_messages = 0
        self.segment_count = 0
        self.failure = ""
        self._run, self._segment, self._ram_bytes = run, segment, ram_bytes
        self._waiting: deque[Message] = deque()
        self._waiting_bytes = 0
        self._writer: SessionWriter | None = None
        self._opened_at = self._retry_at = float("-inf")
        self._dropped_before = 0
        self._events: list[Event] = []
        self._is_sent, self._sent_samples, self._error = False, 0, ""

    def add(self, message: Message) -> None:
        """Queue a message for the next flush; the oldest is dropped if memory is exhausted."""
        self._waiting.append(message)
        self._waiting_bytes += weight(message)
        while self._waiting_bytes > self._ram_bytes:
            self._drop(self._waiting.popleft())

    def _drop(self, message: Message) -> None:
        self._waiting_bytes -= weight(message)
        if isinstance(message, SampleBlock):
            self.dropped_samples += len(message)
        else:
            self.dropped_messages += 1

    def flush(self, now: float, t_ns: int) -> list[Event]:
        """Write waiting messages if possible; returns events (`t_ns`: their time)."""
        self.send(now)
        self.sync()
        return self.settle(now, t_ns)

    def needs_file(self, now: float) -> bool:
        """Whether the next `send` begins a segment, and waits for the disk meanwhile."""
        return self._writer is None or now - self._opened_at >= self._segment

    def send(self, now: float) -> None:
        """Write waiting messages if possible; once until `settle`, before which none is added."""
        if self._waiting and now >= self._retry_at and not self._is_sent:
            self._is_sent = True
            self._try(lambda: self._send(now))

    def sync(self) -> None:
        """Wait until what was sent is on the disk."""
        if self._is_sent and not self._error and self._writer is not None:
            self._try(self._writer.settle)

    def settle(self, now: float, t_ns: int) -> list[Event]:
        """See whether what was sent is on the disk; returns events (`t_ns`: their time)."""
        if self._is_sent and self._error:
            self._fail(self._error, now, t_ns)
        elif self._is_sent:
            self.samples += self._sent_samples
            self._recover(t_ns)
        self._is_sent, self._sent_samples, self._error = False, 0, ""
        events, self._events = self._events, []
        return events

    def _try(self, work: Callable[[], None]) -> None:
        try:
            work()
        except SessionError as error:
            self._error = str(error)

    def _send(self, now: float) -> None:
        if self._writer is not None and now - self._opened_at >= self._segment:
            self._finish()
        if self._writer is None:
            self._open(now)
        self._write_waiting()

    def _open(self, now: float) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = reason_of(error)
            raise SessionError(f"{self.folder}: cannot be made: {reason}") from error
        path = self.folder / segment_name(self.segment_count + 1)
        while path.exists():
            self.segment_count += 1
            path = self.folder / segment_name(self.segment_count + 1)
        self._writer = SessionWriter(path, self._run)
        self.segment_count += 1
        self._opened_at = now

    def _write_waiting(self) -> None:
        writer = self._writer
        assert writer is not None
        while self._waiting:
            message = self._waiting.popleft()
            self._sent_samples += len(message) if isinstance(message, SampleBlock) else 0
            writer.write(message)
        writer.send()
        self._waiting_bytes = 0

    def _fail(self, reason: str, now: float, t_ns: int) -> None:
        """Requeue messages that did not reach the disk, and start a new segment later."""
        self._retry_at = now + RETRY_AFTER
        if self._writer is not None:
            self._waiting.extendleft(reversed(self._writer.pending))
            self._writer.abandon()
            self._writer = None
        # Single samples need a hundred times the memory of the same samples in one block.
        self._waiting = deque(merge_pending(self._waiting, COMPACTED))
        self._waiting_bytes = sum(map(weight, self._waiting))
        if not self.failure:
            self._dropped_before = self.dropped_samples + self.dropped_messages
            self._tell("error", "RECORDING_STOPPED", reason, t_ns)
        self.failure = reason

    def _recover(self, t_ns: int) -> None:
        if self.failure:
            dropped = self.dropped_samples + self.dropped_messages - self._dropped_before
            text = (
                f"writing again in segment {self.segment_count}, {dropped} messages or samples lost"
            )
            self._tell("warning" if dropped else "info", "RECORDING_RESUMED", text, t_ns)
        self.failure = ""

    def _tell(self, severity: Severity, code: str, text: str, t_ns: int) -> None:
        self._events.append(Event(SOURCE, t_ns, severity, code, text))

    def _finish(self) -> None:
        """Close the segment; its data are on the disk even if the index cannot be written."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def move_to(self, folder: Path, run: RunInfo) -> None:
        """Write what is added from now on to the folder of another session.

        Raises:
            SessionError: the segment cannot be closed; what it holds is on the disk.
        """
        self.folder, self._run, self.segment_count = folder, run, 0
        self._finish()

    def close(self, now: float, t_ns: int) -> list[Event]:
        """Write waiting messages and close the segment; unwritten ones count as dropped."""
        self._retry_at = now
        events = self.flush(now, t_ns)
        try:
            self._finish()
        except SessionError as error:
            self._tell("error", "RECORDING_STOPPED", str(error), t_ns)
        while self._waiting:
            self._drop(self._waiting.popleft())
        events += self._events
        self._events = []
        return events
