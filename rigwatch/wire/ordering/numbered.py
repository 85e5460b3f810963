"""A message with its run and its number within the messages of one process.

    bytes    run, number (int64, little endian), then the message's own bytes

To the ordering logic a run is a boot and a message a block of one sample.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rigwatch.wire.errors import MessageError

_PLACE = struct.Struct("<qq")


@dataclass(frozen=True, slots=True)
class Numbered:
    """One message.

    Attributes:
        boot: the run of the process, drawn at its start.
        seq: its number in that run, from 0.
        payload: the message's bytes.
    """

    boot: int
    seq: int
    payload: bytes
    t_ns: ClassVar[tuple[int]] = (0,)
    """Runs are ordered by their tokens; message times are not compared."""

    def __len__(self) -> int:
        return 1

    @property
    def mark(self) -> bytes:
        """Run and number as bytes sent along with the message."""
        return _PLACE.pack(self.boot, self.seq)

    @classmethod
    def marked(cls, mark: bytes, payload: bytes) -> "Numbered":
        """The message received with `mark`.

        Raises:
            MessageError: the mark is invalid.
        """
        try:
            run, number = _PLACE.unpack(mark)
        except struct.error:
            raise MessageError(f"number of a message: {len(mark)} bytes, expected 16") from None
        return cls(run, number, payload)

    def to_bytes(self) -> bytes:
        """Run, number and message, as in a ring's reply."""
        return self.mark + self.payload

    @classmethod
    def from_bytes(cls, data: bytes) -> "Numbered":
        """The message in a ring's reply.

        Raises:
            MessageError: there are too few bytes.
        """
        return cls.marked(data[: _PLACE.size], data[_PLACE.size :])


@dataclass(frozen=True, slots=True)
class NumberedRun:
    """Messages of a run that follow one another, the first of them numbered `seq`."""

    boot: int
    seq: int
    payloads: Sequence[bytes]
    t_ns: ClassVar[tuple[int]] = Numbered.t_ns

    def __len__(self) -> int:
        return len(self.payloads)

    @classmethod
    def marked(cls, marks: Sequence[bytes], payloads: Sequence[bytes]) -> "NumberedRun | None":
        """The messages received with these marks; None unless each follows the one before."""
        if {*map(len, marks)} != {_PLACE.size}:
            return None
        found = struct.unpack(f"<{2 * len(marks)}q", b"".join(marks))
        runs, numbers = found[::2], found[1::2]
        follows = numbers == (*range(numbers[0], numbers[0] + len(numbers)),)
        return cls(runs[0], numbers[0], payloads) if follows and len({*runs}) == 1 else None
