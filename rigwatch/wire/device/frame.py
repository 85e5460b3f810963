"""The frame that the device sends for each sample: COBS around a payload with a CRC-32.

Payload, little endian, for n channels::

    byte   0         1        5       9           13                13+2n      17+2n
           | version | boot   | seq   | device µs | codes           | CRC-32   |
           | u8      | u32    | u32   | u32       | n × i16         | u32      |

COBS replaces the zeros of the payload, so that a zero byte ends a frame and occurs nowhere else::

    | count to next zero | ... payload without zeros ... | 0x00 |

Three channels take 25 bytes, 56 % of a 115 200 baud line at 256 Hz. `seq` and the microseconds
wrap at 2³². A reader that joins in the middle of a frame synchronises at the next zero byte. CRC-32
and not CRC-16: over ten million corrupted frames the shorter one let 150 wrong ones through.
"""

import struct
import zlib
from collections.abc import Callable, Sized
from dataclasses import dataclass
from typing import TypeVar

from rigwatch.wire.errors import FrameError

VERSION = 1
DELIMITER = b"\0"
MAX_CHANNELS = 64
_HEAD = struct.Struct("<BIII")
_CRC = struct.Struct("<I")
HEAD_SIZE, CRC_SIZE = _HEAD.size, _CRC.size
"""Bytes of the payload before the codes, and of the checksum after them."""
LONGEST = HEAD_SIZE + 2 * MAX_CHANNELS + CRC_SIZE + 1
"""Most bytes of an encoded frame, without its delimiter."""
R = TypeVar("R", bound=Sized)
_CODES = [struct.Struct(f"<{n}h") for n in range(MAX_CHANNELS + 1)]


@dataclass(frozen=True, slots=True)
class Frame:
    """One sample as sent by the device.

    Attributes:
        boot: random number that the device draws when it starts, u32.
        seq: number of the sample since then, u32, wraps.
        device_us: the device's clock [µs], u32, wraps.
        codes: raw codes of the converter, one per channel, i16.
    """

    boot: int
    seq: int
    device_us: int
    codes: tuple[int, ...]


def encode(frame: Frame) -> bytes:
    """Encode `frame` for the line, delimiter included.

    Raises:
        FrameError: no channels, too many channels, or a number does not fit its field.
    """
    n = len(frame.codes)
    if not 1 <= n <= MAX_CHANNELS:
        raise FrameError(f"a frame holds 1 to {MAX_CHANNELS} channels, found {n}")
    try:
        body = _HEAD.pack(VERSION, frame.boot, frame.seq, frame.device_us)
        body += _CODES[n].pack(*frame.codes)
    except struct.error as error:
        raise FrameError(f"a number does not fit the frame: {error}") from error
    return _stuff(body + _CRC.pack(zlib.crc32(body))) + DELIMITER


def decode(encoded: bytes) -> Frame:
    """The frame in `encoded`, the bytes between two delimiters.

    Raises:
        ChecksumError: the checksum does not match.
        FrameError: framing, length or version is wrong.
    """
    payload = _unstuff(encoded)
    n, odd = divmod(len(payload) - HEAD_SIZE - CRC_SIZE, 2)
    if n < 1 or odd or n > MAX_CHANNELS:
        raise FrameError(f"{len(payload)} bytes are no frame")
    if zlib.crc32(payload[:-CRC_SIZE]) != _CRC.unpack_from(payload, len(payload) - CRC_SIZE)[0]:
        raise ChecksumError("the CRC-32 of a frame does not match")
    version, boot, seq, device_us = _HEAD.unpack_from(payload)
    if version != VERSION:
        raise FrameError(f"frame version {version}, expected {VERSION}")
    return Frame(boot, seq, device_us, _CODES[n].unpack_from(payload, _HEAD.size))


class ChecksumError(FrameError):
    """Length and framing are valid, the checksum is not."""


class FrameDecoder:
    """Turns the bytes of a serial line, in any pieces, into frames.

    Attributes:
        good: frames accepted.
        crc_errors: frames of the right shape with a wrong checksum.
        skipped_bytes: bytes that belong to no accepted frame, delimiters not counted.
        resyncs: how often a good frame followed skipped bytes.
    """

    def __init__(self) -> None:
        self.good = 0
        self.crc_errors = 0
        self.skipped_bytes = 0
        self.resyncs = 0
        self._rest = b""
        self._lost = False

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that `data` completes, in order; never raises."""
        *pieces, self._rest = (self._rest + data).split(DELIMITER)
        frames = [frame for piece in pieces if piece and (frame := self._try(piece))]
        if len(self._rest) > LONGEST:
            # Longer than any frame without a delimiter: keep a bounded tail only.
            self._skip(len(self._rest) - LONGEST)
            self._rest = self._rest[-LONGEST:]
        return frames

    def feed_run(self, data: bytes, read: Callable[[bytes], R | None]) -> R | None:
        """What `read` makes of the frames that `data` completes, as many as its length says.

        Args:
            data: the next bytes of the line.
            read: given whole frames with delimiters between them; None if it leaves them to `feed`.

        Returns:
            None if `data` is to be fed with `feed`: nothing has been taken from it.
        """
        found = self.completed(data)
        run = None if found is None else read(found[0])
        if found is not None and run is not None:
            self.took(len(run), found[1])
        return run

    def completed(self, data: bytes) -> tuple[bytes, bytes] | None:
        """The frames that `data` completes, and its rest; None if only `feed` may take it.

        Whoever has read all of the frames calls `took`; otherwise nothing has been taken.
        """
        whole, found, rest = (self._rest + data).rpartition(DELIMITER)
        return None if not found or self._lost or len(rest) > LONGEST else (whole, rest)

    def took(self, frames: int, rest: bytes) -> None:
        """Count frames that `completed` gave, and keep what has come after them."""
        self._rest = rest
        self.good += frames

    def forget(self) -> None:
        """Drop an unfinished frame, as after a closed line; its bytes count as skipped."""
        self._skip(len(self._rest))
        self._rest = b""

    def _try(self, piece: bytes) -> Frame | None:
        try:
            frame = decode(piece)
        except FrameError as error:
            self.crc_errors += isinstance(error, ChecksumError)
            self._skip(len(piece))
            return None
        self.good += 1
        self.resyncs += self._lost
        self._lost = False
        return frame

    def _skip(self, count: int) -> None:
        self.skipped_bytes += count
        self._lost |= count > 0


def _stuff(payload: bytes) -> bytes:
    """COBS for at most 253 bytes, which needs no long blocks."""
    return b"".join(bytes((len(part) + 1,)) + part for part in payload.split(DELIMITER))


def _unstuff(encoded: bytes) -> bytes:
    parts = []
    at, end = 0, len(encoded)
    while at < end:
        following = at + encoded[at]
        if encoded[at] == 0 or following > end:
            raise FrameError("COBS counts do not fit the frame")
        parts.append(encoded[at + 1 : following])
        at = following
    return DELIMITER.join(parts)
