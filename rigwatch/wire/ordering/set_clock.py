"""By how much the clock of samples was set, told by the clock of their device.

Stamps follow the host's clock, which people and time servers set. The device counts on its
microseconds, whatever becomes of the host; where the device itself pauses or jumps, its steps are
the odd ones.
"""

import numpy as np

from rigwatch.wire.arrays import IntArray

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
