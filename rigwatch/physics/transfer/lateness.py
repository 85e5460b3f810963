"""How late a channel of the motion is behind the channel that measures its rate of change.

Position and acceleration often come from sensors with different conditioners. A demodulator or a
filter delays one of them by a few milliseconds. Both see the same motion, so the delay shows
without a model, in the phase between the differentiated position and the acceleration:

    φ(ω) = ω·τ + c/ω,   τ: lateness of the position, c: corners of high-passes (AC coupling)

A force that depends on a late position would otherwise be predicted late, and every effect at the
load would leave the difference as a residual. Corners and lateness determined here, by the motion
alone, cannot stand in for what a model of the plant describes poorly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from rigwatch.wire.arrays import FloatArray

SEGMENT = 512
"""Samples of a spectrum's segment."""
LOW, HIGH = 4, 0.25
"""Lowest line and highest frequency used, the latter relative to the rate."""
COHERENT, ALIKE = 0.5, 0.99
"""Least coherence of a frequency line, and of the whole of both signals once shifted: above 0.999
for position and acceleration, less where the other channel is not the derivative."""
SURE = 4.0
"""Standard deviations by which a lateness must differ from zero."""
LEAST, MOST = 0.03, 2.0
"""Smallest lateness that matters and largest that is believed [samples]."""

CLOSE = 0.02
"""Largest standard deviation of a corner that counts as known, over the lowest frequency used."""

Pair = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class SensorPhase:
    """Phase between a differentiated channel and the measurement of its derivative.

    Attributes:
        late, late_deviation: lateness of the channel, with its standard deviation [samples].
        corner, corner_deviation: sum of the measurement's high-pass corners [rad/sample].
        lowest: lowest frequency used [rad/sample].
        dt: time between samples [s].
    """

    late: float
    late_deviation: float
    corner: float
    corner_deviation: float
    lowest: float
    dt: float

    @property
    def shift(self) -> float:
        """Lateness of the channel if it is sure and matters, otherwise 0 [s]."""
        sure = abs(self.late) > SURE * self.late_deviation and LEAST < abs(self.late) <= MOST
        return self.late * self.dt if sure else 0.0

    @property
    def is_late_known(self) -> bool:
        """Whether no lateness that matters is left once the channel is shifted."""
        return self.late_deviation < LEAST and abs(self.late) <= MOST

    @property
    def known_corner(self) -> float | None:
        """Sum of the corners [1/s]; None if the recordings leave it open."""
        known = self.corner_deviation < CLOSE * self.lowest
        return self.corner / self.dt if known else None


def lateness(pairs: Sequence[Pair], dt: float, order: int) -> float:
    """Lateness of a channel behind its derivative's [s], 0 if the two do not tell.

    Args:
        pairs: of each recording, the channel and the measurement of its derivative, without gaps,
            each of shape (n,).
        dt: time between samples [s].
        order: of the derivative.
    """
    phase = sensor_phase(pairs, dt, order)
    return phase.shift if phase else 0.0


def sensor_phase(pairs: Sequence[Pair], dt: float, order: int) -> SensorPhase | None:
    """Lateness of a channel and high-pass of its derivative's sensor; None if the two do not tell.

    Args:
        pairs, dt, order: see `lateness`.
    """
    long = [pair for pair in pairs if len(pair[0]) >= 2 * SEGMENT]
    if not long:
        return None
    own, other, cross, segments = _spectra(long, order)
    omega: FloatArray = 2.0 * np.pi * np.arange(len(own)) / SEGMENT
    coherence = np.abs(cross) ** 2 / np.maximum(own * other, 1e-300)
    used = (coherence > COHERENT) & (np.arange(len(own)) >= LOW) & (omega < 2.0 * np.pi * HIGH)
    if used.sum() <= 2:
        return None
    found, deviations, phase = _fitted(omega[used], cross[used], coherence[used], segments)
    together = np.abs(np.sum(cross[used] * np.exp(-1j * phase))) ** 2
    if together / (own[used].sum() * other[used].sum()) <= ALIKE:
        return None
    lowest = float(omega[used][0])
    return SensorPhase(
        float(found[0]), float(deviations[0]), float(found[1]), float(deviations[1]), lowest, dt
    )


def _spectra(pairs: Sequence[Pair], order: int) -> tuple[FloatArray, FloatArray, np.ndarray, float]:
    """Power of the differentiated channel, of its measurement, both crossed; segments averaged."""
    own, other, cross, segments = [], [], [], 0.0
    for channel, rate in pairs:
        steep, level = _differentiated(channel, rate, order)
        settings = {"nperseg": SEGMENT, "detrend": "constant", "scaling": "spectrum"}
        weight = len(steep) / SEGMENT
        own.append(weight * scipy.signal.welch(steep, **settings)[1])
        other.append(weight * scipy.signal.welch(level, **settings)[1])
        cross.append(weight * scipy.signal.csd(steep, level, **settings)[1])
        segments += weight
    return sum(own), sum(other), sum(cross), segments


def _differentiated(channel: FloatArray, rate: FloatArray, order: int) -> Pair:
    """Central differences of the channel, and its measurement at the same instants."""
    for _ in range(order // 2):
        channel, rate = np.diff(channel, 2), rate[1:-1]
    if order % 2:
        channel, rate = 0.5 * (channel[2:] - channel[:-2]), rate[1:-1]
    return channel, rate


def _fitted(
    omega: FloatArray, cross: np.ndarray, coherence: FloatArray, segments: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lateness and corner, their standard deviations, and the fitted phase of the measurement."""
    angle = np.angle(cross)
    spread = np.sqrt((1.0 - coherence) / (2.0 * coherence * segments)) + 1e-4
    columns = np.column_stack([omega, 1.0 / omega])
    found = np.linalg.lstsq(columns / spread[:, None], angle / spread, rcond=None)[0]
    left = (angle - columns @ found) / spread
    size = max(float(np.sqrt(np.sum(left**2) / (len(omega) - 2))), 1.0)
    inverse = np.linalg.inv((columns / spread[:, None]).T @ (columns / spread[:, None]))
    return found, size * np.sqrt(np.diag(inverse)), columns @ found
