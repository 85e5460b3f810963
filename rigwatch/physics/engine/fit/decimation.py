"""Filters residuals and sensitivities alike, and takes every q-th sample of them.

A model that reads force from measured motion differentiates twice, and its residual is mostly noise
of high frequency. Low-passing the residual and every column of the Jacobian with one filter leaves
the least squares unbiased ("parallel filtering": M. Gautier, IEEE ICRA 1997).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import decimate, lfilter

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True)
class Thinning:
    """One sample in `factor`, without `edge` of them at both ends of each part.

    Attributes:
        factor: samples for one that stays.
        edge: samples that are left out at both ends, counted after thinning.
        parts: lengths of the recordings that lie one behind the other.
        high_pass: numerator and denominator of a filter before that, which takes away what is slow.
    """

    factor: int
    edge: int
    parts: tuple[int, ...]
    high_pass: tuple[FloatArray, FloatArray] | None = None

    def apply(self, signals: FloatArray) -> FloatArray:
        """Thin along axis 1 of shape (windows, samples, …).

        Raises:
            ModelError: a part is too short.
        """
        ends = np.cumsum(self.parts)
        cut = [self._part(p) for p in np.split(signals, ends[:-1], axis=1)]
        return np.concatenate(cut, axis=1)

    def of_part(self, samples: int) -> "Thinning":
        """The same for one recording of so many samples."""
        return replace(self, parts=(samples,))

    def _part(self, part: FloatArray) -> FloatArray:
        if part.shape[1] < self.factor * (2 * self.edge + 4):
            raise ModelError(
                f"found a recording of {part.shape[1]} samples, expected at least"
                f" {self.factor * (2 * self.edge + 4)} to thin it by {self.factor}"
            )
        if self.high_pass:
            part = lfilter(*self.high_pass, part, axis=1)
        if self.factor > 1:
            part = decimate(part, self.factor, axis=1, zero_phase=True)
        return part[:, self.edge : part.shape[1] - self.edge]
