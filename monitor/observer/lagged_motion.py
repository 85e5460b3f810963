"""The measured motion in real time: each signal filtered by a short symmetric kernel, fixed lag.

Signals that are not differentiated are delayed by the same lag, so all columns refer to the same
instant. The kernels are third-order polynomial fits to the samples around each instant
(A. Savitzky, M. Golay, Analytical Chemistry 36, 1964).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from monitor.signals import DEAD, GOOD, NEW_BOOT, RESTART, Codes
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

DELAY, MATCHED, STEPPED, STEPPED_BEFORE = -1, -2, -3, -4
"""Codes of columns that are only delayed, smoothed like one that is differentiated twice, half the
change from the sample before to the sample after, or the change from the sample before.
"""


@dataclass(frozen=True, slots=True)
class MotionColumn:
    """One column: a channel by index, smoothed and differentiated `order` times, or delayed."""

    channel: int
    order: int


class FixedLag:
    """Carries the last samples from block to block.

    Args:
        columns: columns computed from the channels.
        half_width: lag [samples].
        rate: sample rate [Hz].
        late: lateness of the smoothed channels behind the delayed ones [s].
        fills: whether held readings are replaced by the line between both ends of their gap.
    """

    def __init__(
        self,
        columns: Sequence[MotionColumn],
        half_width: int,
        rate: float,
        late: float = 0.0,
        fills: bool = True,
    ) -> None:
        self._fills = fills
        kernels = [motion_kernel(column.order, half_width, rate, late) for column in columns]
        self._kernels = np.array(kernels)
        self._channels = np.array([column.channel for column in columns])
        self._ring = np.zeros((2 * half_width + 1, int(self._channels.max()) + 1))
        self._count = np.zeros(4, np.int64)

    def update(self, signals: FloatArray, code: Codes) -> tuple[FloatArray, Codes]:
        """Convert the next samples, shape (n, channels), to columns, (n, columns), with states.

        The state of a sample is 0 with an incomplete kernel, 1 for the first complete one after a
        start, 2 for a good sample, 3 if a reading within its kernel is held.
        """
        out = np.zeros((code.size, self._channels.size))
        state = np.zeros(code.size, np.int64)
        _advance(
            signals, code, self._kernels, self._channels, self._fills, self._ring, self._count,
            out, state,
        )  # fmt: skip
        return out, state


EMPTY, FIRST, WHOLE, TAINTED = 0, 1, 2, 3
"""States of a sample, see `FixedLag.update`."""


def motion_kernel(order: int, half_width: int, rate: float, late: float = 0.0) -> FloatArray:
    """Weights of a column of this order, oldest sample first, shape (2·half_width + 1,)."""
    width = 2 * half_width + 1
    if order == DELAY:
        return np.asarray(np.eye(width)[half_width], np.float64)
    if order == STEPPED:
        return np.asarray(0.5 * (np.eye(width)[half_width + 1] - np.eye(width)[half_width - 1]))
    if order == STEPPED_BEFORE:
        return np.asarray(np.eye(width)[half_width] - np.eye(width)[half_width - 1])
    if order == MATCHED:
        # The kernel of the second derivative is a second difference of a smoothing one.
        second = scipy.signal.savgol_coeffs(width, 3, deriv=2, delta=1.0, use="dot")
        smoothing = np.cumsum(np.cumsum(second))[:-2]
        return np.asarray(np.concatenate([[0.0], smoothing, [0.0]]), np.float64)
    at = half_width + late * rate
    return np.asarray(
        scipy.signal.savgol_coeffs(width, 3, deriv=order, delta=1.0 / rate, pos=at, use="dot")
    )


@part()
def _interpolate(ring: FloatArray, count: Codes) -> None:
    """Replace the held samples before the newest by the line between both ends of the gap."""
    width, held, newest = ring.shape[0], count[3], count[0] - 1
    for c in range(ring.shape[1]):
        first, last = ring[(newest - held - 1) % width, c], ring[newest % width, c]
        for k in range(1, held + 1):
            ring[(newest - k) % width, c] = last + (first - last) * k / (held + 1.0)


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    signals: FloatArray,
    code: Codes,
    kernels: FloatArray,
    channels: NDArray[np.int64],
    fills: bool,
    ring: FloatArray,
    count: Codes,
    out: FloatArray,
    state: Codes,
) -> None:
    """`count` holds the ring's head, samples since the start, samples since a held one, and the
    number of those that are held now.
    """
    width = ring.shape[0]
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            count[1] = 0
            count[2] = width
        if code[k] == DEAD:
            continue
        for c in range(ring.shape[1]):
            ring[count[0], c] = signals[k, c]
        count[0] = (count[0] + 1) % width
        count[1] += 1
        good = code[k] == GOOD or code[k] == RESTART or code[k] == NEW_BOOT
        if fills and code[k] == GOOD and 0 < count[3] < width - 1:
            _interpolate(ring, count)
        count[3] = 0 if good else count[3] + 1
        count[2] = min(count[2] + 1, width) if good else 0
        if count[1] < width:
            continue
        state[k] = FIRST if count[1] == width else (WHOLE if count[2] >= width else TAINTED)
        for c in range(channels.size):
            total = 0.0
            for j in range(width):
                total += kernels[c, j] * ring[(count[0] + j) % width, channels[c]]
            out[k, c] = total
