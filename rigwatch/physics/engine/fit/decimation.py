"""Filters residuals and sensitivities with the same filter and decimates them by q.

A model that computes force from measured motion differentiates twice, and its residual is mostly
high-frequency noise. Low-passing the residual and every column of the Jacobian with the same filter
keeps the least-squares estimate unbiased ("parallel filtering": M. Gautier, IEEE ICRA 1997).
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

PASSED = 0.8
"""Share of its new band that decimation passes."""
PADDED = 27
"""Samples by which a recording is continued at both ends before it is low-passed twice."""


@dataclass(frozen=True)
class Thinning:
    """Decimation by `factor`, dropping `edge` samples at both ends of each part.

    Attributes:
        factor: decimation factor.
        edge: samples dropped at both ends, counted after decimation.
        parts: lengths of the concatenated recordings.
        high_pass: numerator and denominator of a high-pass applied first.
    """

    factor: int
    edge: int
    parts: tuple[int, ...]
    high_pass: tuple[FloatArray, FloatArray] | None = None

    def apply(self, signals: FloatArray) -> FloatArray:
        """Filter and decimate along axis 1 of shape (windows, samples, …).

        Raises:
            ModelError: a part is too short.
        """
        ends = np.cumsum(self.parts)
        cut = [self._part(p) for p in np.split(signals, ends[:-1], axis=1)]
        return np.concatenate(cut, axis=1)

    @property
    def kept(self) -> float:
        """Share of the energy of white noise that decimation keeps."""
        return PASSED / self.factor if self.factor > 1 else 1.0

    def of_part(self, samples: int) -> "Thinning":
        """The decimation for one recording of a given length."""
        return replace(self, parts=(samples,))

    def _part(self, part: FloatArray) -> FloatArray:
        least = self.factor * (2 * self.edge + 4)
        if self.factor > 1:
            least = max(least, PADDED + 1)
        if part.shape[1] < least:
            raise ModelError(
                f"found a recording of {part.shape[1]} samples, expected at least {least} to thin"
                f" it by {self.factor}"
            )
        if self.high_pass:
            part = scipy.signal.lfilter(*self.high_pass, part, axis=1)
        if self.factor > 1:
            part = scipy.signal.sosfiltfilt(_low_pass(self.factor), part, axis=1)[:, :: self.factor]
        return part[:, self.edge : part.shape[1] - self.edge]


@cache
def _low_pass(factor: int) -> FloatArray:
    """The filter of `scipy.signal.decimate`, designed once; second-order sections (…, 6)."""
    return np.asarray(scipy.signal.cheby1(8, 0.05, PASSED / factor, output="sos"))
