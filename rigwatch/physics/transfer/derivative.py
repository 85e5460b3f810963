"""Signals derived from a channel: low-passed with zero phase, then differentiated.

What the filter does to the channel's noise is known, so that the noise of a derived signal is not
looked for where its own low-pass has taken it away.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from rigwatch.wire.arrays import FloatArray

FILTER_ORDER = 4
"""Of the Butterworth filter, which passes forwards and backwards."""
HIGHEST = 0.4999
"""Frequency over the rate above which the low-pass passes as little as there."""


@dataclass(frozen=True)
class Derivative:
    """A low-pass and a number of differentiations.

    Attributes:
        low_pass: corner [Hz].
        order: number of differentiations.
        rate: sample rate of the channel [Hz].
    """

    low_pass: float
    order: int
    rate: float

    def of(self, signal: FloatArray) -> FloatArray:
        """The derived signal, in the signal's unit per second to the power of `order`.

        Args:
            signal: 16 samples or more, as the low-pass continues it at both ends; all finite.
        """
        filters = scipy.signal.butter(FILTER_ORDER, self.low_pass, fs=self.rate, output="sos")
        found = scipy.signal.sosfiltfilt(filters, signal)
        for _ in range(self.order):
            found = np.gradient(found, 1 / self.rate)
        return np.asarray(found)

    def power(self, frequencies: FloatArray) -> FloatArray:
        """Power density of the derived signal over that of the channel, (n,), at these [Hz].

        The filter's is that of the bilinear transform, squared as it passes twice; a difference of
        neighbours on both sides of a sample is a sine of the frequency.
        """
        turn, corner = np.pi * frequencies / self.rate, np.pi * self.low_pass / self.rate
        # The bilinear transform puts infinity at half the rate.
        warped = np.tan(np.minimum(turn, HIGHEST * np.pi)) / np.tan(corner)
        twice = (1.0 + warped ** (2 * FILTER_ORDER)) ** -2.0
        return np.asarray(twice * (self.rate * np.sin(2 * turn)) ** (2 * self.order))
