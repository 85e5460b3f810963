"""By how much the clock of samples was set, told by the clock of their device.

Stamps follow the host's clock, which people and time servers set. The device counts on its
microseconds, whatever becomes of the host; where the device itself pauses or jumps, its steps are
the odd ones.
"""

from collections.abc import Sequence

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.messages import SampleBlock

LEAST_SET_NS, MOST_DRIFT = 500_000_000, 1e-3
"""What a clock is set by at least [ns], and how fast or slow it may run over a gap."""


def set_by_ns(t_ns: IntArray, device_us: IntArray, seq: IntArray, usual_ns: float) -> IntArray:
    """By how much the clock was set before each sample but the first [ns]; 0 where it was not.

    Args:
        t_ns: shape (n,), stamps of samples of one boot, in order [ns].
        device_us: shape (n,), the device's clock [us].
        seq: shape (n,), their numbers.
        usual_ns: time from a sample to the next [ns].

    Returns:
        Shape (n - 1,).
    """
    steps, by_device = np.diff(t_ns), 1000 * np.diff(device_us)
    expected = usual_ns * np.diff(seq)
    odd = steps - by_device
    was_set = np.abs(odd) > LEAST_SET_NS + MOST_DRIFT * expected
    was_set &= np.abs(by_device - expected) < np.abs(steps - expected)
    was_set &= by_device > expected / 2
    return np.where(was_set, odd, 0)


def elapsed_ns(blocks: Sequence[SampleBlock]) -> IntArray:
    """Time from the first sample to each [ns], which never goes back, whatever the clock did.

    Args:
        blocks: all samples of a device, in order; at least one.
    """
    t_ns = np.concatenate([block.t_ns for block in blocks])
    device_us = np.concatenate([block.device_us for block in blocks])
    seq = np.concatenate([block.seq + np.arange(len(block)) for block in blocks])
    boots = np.concatenate([np.full(len(block), block.boot, np.uint64) for block in blocks])
    steps, numbers = np.diff(t_ns), np.diff(seq)
    follows = (boots[1:] == boots[:-1]) & (numbers > 0)
    usual = float(np.median(steps[follows] / numbers[follows])) if follows.any() else 0.0
    steps -= np.where(follows, set_by_ns(t_ns, device_us, seq, usual), 0)
    # Across a start of the device, nothing tells by how much.
    steps[steps < 0] = round(usual)
    return np.concatenate([[0], np.cumsum(steps)])
