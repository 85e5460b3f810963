"""The two compiled calls for the blocks of several rigs that have as many channels.

Between them, samples are stamped that lie along no line of their clock (`DeviceClock`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.adapters import read_frames
from daq.clock import stamp_along
from daq.conditioning import calibrate
from daq.sequence import BOOT, SEQ, take_next
from daq.together.message_text import Text, write_text
from daq.together.ring_rows import put_run
from daq.together.seat import RigState
from rigwatch.wire.arrays import BoolArray, IntArray
from rigwatch.wire.device import VERSION
from rigwatch.wire.kept_state import kept
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray


class Blocks(NamedTuple):
    """A block of each of r rigs, of up to m samples.

    Attributes:
        size: samples of the rig's block, 0 if it was not taken, shape (r,).
        stamped: how many of them are stamped, shape (r,).
        told: numbers and device's clock [µs] as the device told them, shape (r, 2, m).
        samples: numbers, device's clock [µs] and arrival [ns], shape (r, 3, m).
        stamps: Unix time [ns], shape (r, m).
        codes: shape (r, m, channels).
        flags: quality, shape (r, m, channels).
        flagged: whether any sample has a flag, shape (r,).
    """

    size: IntArray
    stamped: IntArray
    told: IntArray
    samples: IntArray
    stamps: IntArray
    codes: NDArray[np.int16]
    flags: ByteArray
    flagged: BoolArray


def blocks_for(rigs: int, most: int, channels: int) -> Blocks:
    """Room for blocks of up to `most` samples."""
    return Blocks(
        np.zeros(rigs, np.int64),
        np.zeros(rigs, np.int64),
        np.empty((rigs, 2, most), np.int64),
        np.empty((rigs, 3, most), np.int64),
        np.empty((rigs, most), np.int64),
        np.empty((rigs, most, channels), np.int16),
        np.empty((rigs, most, channels), np.uint8),
        np.zeros(rigs, np.bool_),
    )


@kernel(allocates=True)
def number_and_stamp(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    like: RigState,
    rigs: IntArray,
    data: ByteArray,
    starts: IntArray,
    arrived: IntArray,
    longest: IntArray,
    blocks: Blocks,
) -> None:
    """Take the frames of each rig whose samples are the next ones, and stamp them along its line.

    Args:
        like: state of one of the rigs.
        rigs: addresses of their states, shape (r,).
        data: their frames one after the other.
        starts: where those of each rig begin, shape (r + 1,).
        arrived: when the last byte arrived [ns], shape (r,).
        longest: most samples that are taken, shape (r,).
        blocks: filled; of a rig that is not taken, nothing has changed.
    """
    boot = np.empty(1, np.int64)
    for r in range(rigs.size):
        told, codes = blocks.told[r], blocks.codes[r]
        n = read_frames(data[starts[r] : starts[r + 1]], VERSION, boot, told, codes)
        if n <= 0 or n > longest[r]:
            continue
        state, samples = kept(like, rigs[r]), blocks.samples[r, :, :n]
        first = state.tracker[SEQ] + 1
        for k in range(n):
            samples[0, k], samples[2, k] = first + k, arrived[r]
        if not take_next(state.tracker, boot[0], told[0, :n], told[1, :n], samples[2], samples[1]):
            continue
        blocks.size[r] = n
        blocks.stamped[r] = stamp_along(state.place, state.line, samples, 0, blocks.stamps[r, :n])


@kernel(allocates=True)
def keep_and_write(  # noqa: PLR0917
    like: RigState,
    rigs: IntArray,
    like_text: Text,
    texts: IntArray,
    rows: IntArray,
    starts: IntArray,
    blocks: Blocks,
    to: ByteArray,
) -> None:
    """Calibrate and flag the blocks, store them in the rigs' rings, and write their messages.

    Args:
        like: state of one of the rigs.
        rigs: addresses of their states, shape (r,).
        like_text: text of one of the blocks.
        texts: addresses of those of the blocks that were taken, shape (t,).
        rows: which those are, shape (t,).
        starts: where the message of each begins, shape (t + 1,).
        blocks: stamped; flags are filled.
        to: the messages, filled.
    """
    for i in range(texts.size):
        r = rows[i]
        n, state, samples = blocks.size[r], kept(like, rigs[r]), blocks.samples[r]
        codes = np.empty((n, blocks.codes.shape[2]))
        values, flags = np.empty(codes.shape), np.empty(codes.shape, np.uint8)
        for k in range(n):
            for c in range(codes.shape[1]):
                codes[k, c] = blocks.codes[r, k, c]
        calibrate(state.channels, codes, values, flags)
        blocks.flagged[r] = _any(flags)
        blocks.flags[r, :n] = flags
        first, device_us, t_ns = samples[0, 0], samples[1, :n], blocks.stamps[r, :n]
        put_run(state.ring, first, device_us, t_ns, values, flags)
        text, message = kept(like_text, texts[i]), to[starts[i] : starts[i + 1]]
        boot = state.tracker[BOOT]
        write_text(text, message, boot, first, device_us, t_ns, values, flags)


@part()
def _any(flags: ByteArray) -> bool:
    return bool(flags.any())
