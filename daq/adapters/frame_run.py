"""Reads the frames of one reading in a compiled call, if all are intact and of one boot.

Anything else, and thereby everything that is counted or reported, is left to `FrameDecoder`.
"""

import numpy as np
from numpy.typing import NDArray

from daq.adapter import RawBlock
from rigwatch.wire.arrays import IntArray
from rigwatch.wire.device import CRC_SIZE, HEAD_SIZE, LONGEST, VERSION
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray

_POLYNOMIAL = 0xEDB88320


def _crc_table() -> NDArray[np.uint32]:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(_POLYNOMIAL), table >> 1)
    return table.astype(np.uint32)


_TABLE = _crc_table()


def read_run(whole: bytes, channels: int, arrived_ns: int) -> RawBlock | None:
    """The samples in `whole`, which ends before the last frame's delimiter.

    Args:
        whole: encoded frames with a delimiter between each two.
        channels: that each of them must have.
        arrived_ns: when the last byte arrived [ns].

    Returns:
        None if a frame is damaged, of another shape, or not of the first one's boot.
    """
    most = most_frames(len(whole), channels)
    numbers, codes = np.empty((2, most), np.int64), np.empty((most, channels), np.int16)
    boot = np.empty(1, np.int64)
    found = read_frames(np.frombuffer(whole, np.uint8), VERSION, boot, numbers, codes)
    if found <= 0:
        return None
    seq, device_us = numbers[:, :found]
    return RawBlock(int(boot[0]), seq, device_us, codes[:found], np.full(found, arrived_ns))


def most_frames(size: int, channels: int) -> int:
    """How many frames so many bytes hold at most."""
    return size // (HEAD_SIZE + 2 * channels + CRC_SIZE) + 1


@kernel(allocates=True)
def read_frames(
    data: ByteArray, version: int, boot: IntArray, numbers: IntArray, codes: NDArray[np.int16]
) -> int:
    """Read encoded frames with a delimiter between each two.

    Args:
        data: the frames.
        version: of frames.
        boot: shape (1,), filled.
        numbers: shape (2, `most_frames`), filled: of the samples, and the device's clock [µs].
        codes: shape (`most_frames`, channels), filled.

    Returns:
        Their number; -1 if one is damaged, of another shape, or not of the first one's boot.
    """
    channels = codes.shape[1]
    size = HEAD_SIZE + 2 * channels + CRC_SIZE
    frame = np.empty(LONGEST, np.uint8)
    at = found = 0
    while at < data.size:
        end = at
        while end < data.size and data[end] != 0:
            end += 1
        if _unstuff(data, at, end, frame) != size or frame[0] != version:
            return -1
        if _checksum(frame, size - CRC_SIZE) != _u32(frame, size - CRC_SIZE):
            return -1
        if found > 0 and _u32(frame, 1) != boot[0]:
            return -1
        boot[0] = _u32(frame, 1)
        numbers[0, found], numbers[1, found] = _u32(frame, 5), _u32(frame, 9)
        for k in range(channels):
            place = HEAD_SIZE + 2 * k
            code = np.int64(frame[place]) | np.int64(frame[place + 1]) << 8
            codes[found, k] = code - 65536 if code >= 32768 else code
        found += 1
        at = end + 1
    return found


@part()
def _unstuff(data: ByteArray, at: int, end: int, frame: ByteArray) -> int:
    """Write the payload of the COBS frame from `at` to `end`; its length, -1 if it is none."""
    if end - at > frame.size:
        return -1
    size = 0
    while at < end:
        following = at + data[at]
        if data[at] == 0 or following > end:
            return -1
        for k in range(at + 1, following):
            frame[size] = data[k]
            size += 1
        at = following
        if at < end:
            frame[size] = 0
            size += 1
    return size


@part()
def _checksum(frame: ByteArray, size: int) -> int:
    """CRC-32 of the first bytes."""
    value = np.uint32(0xFFFFFFFF)
    for k in range(size):
        value = _TABLE[(value ^ frame[k]) & np.uint32(0xFF)] ^ (value >> np.uint32(8))
    return int(value ^ np.uint32(0xFFFFFFFF))


@part()
def _u32(frame: ByteArray, at: int) -> int:
    low = np.int64(frame[at]) | np.int64(frame[at + 1]) << 8
    return int(low | np.int64(frame[at + 2]) << 16 | np.int64(frame[at + 3]) << 24)
