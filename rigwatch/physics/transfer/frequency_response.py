"""Frequency response of a recording, with the coherence that shows where it is reliable.

    H1 = Suy / Suu,   γ² = |Suy|² / (Suu·Syy)

averaged over overlapping Hann segments (Welch). The variance of H1 is about
|H1|²·(1 - γ²)/(2·n·γ²) for n segments, which gives the weights of the fit.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Response y/u over frequency.

    Args:
        frequency: [Hz], shape (m,).
        response: unit of y over unit of u, shape (m,).
        coherence: 0 to 1, shape (m,).
        sample_rate: [Hz].
    """

    frequency: FloatArray
    response: NDArray[np.complex128]
    coherence: FloatArray
    sample_rate: float

    def band(self, low: float, high: float, least_coherence: float = 0.0) -> "FrequencyResponse":
        """The lines from `low` to `high` [Hz] with at least that coherence.

        Raises:
            ModelError: fewer than eight lines are left.
        """
        keep = (self.frequency >= low) & (self.frequency <= high)
        keep &= self.coherence >= least_coherence
        if np.count_nonzero(keep) < 8:
            raise ModelError(
                f"frequency response: found {np.count_nonzero(keep)} lines "
                f"from {low:g} to {high:g} Hz with "
                f"coherence {least_coherence:g} or more, expected at least 8"
            )
        return FrequencyResponse(
            self.frequency[keep], self.response[keep], self.coherence[keep], self.sample_rate
        )

    def weights(self) -> FloatArray:
        """Weights for relative errors: √(γ²/(1 - γ²))/|H|, γ² at most 0.999, shape (m,)."""
        coherence = np.clip(self.coherence, 1e-6, 0.999)
        return np.asarray(np.sqrt(coherence / (1.0 - coherence)) / np.abs(self.response))


def frequency_response(
    u: FloatArray, y: FloatArray, sample_rate: float, segment: float = 8.0
) -> FrequencyResponse:
    """Estimate y/u from one recording of a chirp or multisine.

    Args:
        u, y: input and output, shape (n,), finite.
        sample_rate: [Hz].
        segment: length of an averaged segment [s]; shorter recordings use a quarter of their
            length.

    Raises:
        ModelError: the recording is shorter than 64 samples, or the input is constant.
    """
    if u.size < 64:
        raise ModelError(f"frequency response: found {u.size} samples, expected at least 64")
    if np.ptp(u) == 0.0:
        raise ModelError("frequency response: found a constant input, expected an excitation")
    length = int(min(segment * sample_rate, u.size / 4))
    options = {"fs": sample_rate, "nperseg": length, "noverlap": length * 3 // 4}
    frequency, suu = scipy.signal.welch(u, **options)
    _, syy = scipy.signal.welch(y, **options)
    _, suy = scipy.signal.csd(u, y, **options)
    floor = np.finfo(np.float64).tiny
    coherence = np.abs(suy) ** 2 / np.maximum(suu * syy, floor)
    return FrequencyResponse(
        frequency, suy / np.maximum(suu, floor), np.clip(coherence, 0.0, 1.0), sample_rate
    )
