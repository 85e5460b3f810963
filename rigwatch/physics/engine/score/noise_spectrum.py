"""The noise of a fit's residual by frequency band, corrected for what the fit has taken of it.

A fit takes part of the noise with every parameter and initial state, most of it where the noise of
a short window is slowest, and smears some of the rest. With s the spectral density of the noise and
M_bc the energy that noise of unit density in band c leaves in band b, a residual shows

    energy_b = Σ_c M_bc·s_c

M is found by passing simulated noise through the fit's projection. The equation is solved by
iterations that keep s positive (W. H. Richardson, 1972; L. B. Lucy, 1974). Each output has bands of
its own. They double in width, as coloured noise varies with the logarithm of the frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import BoolArray, ComplexArray, FloatArray, IntArray

NARROWEST = 8
"""Width of the lowest bands, in half cycles over the recording: as many degrees of freedom."""
ITERATIONS = 15
ENOUGH = 16.0
"""Degrees of freedom below which a density is held against that of the bands above, too."""
LEAST = 0.1
"""Smallest share of a band's degrees of freedom that a candidate leaves."""
SIMULATED = 8000
"""Samples of simulated noise in each band, at least."""
AGAIN = 2
"""Smallest number of realisations of it."""


@dataclass(frozen=True, eq=False)
class NoiseBands:
    """Bands of a recording, and what a fit leaves of noise in them.

    Attributes:
        first: first frequency of each band, in half cycles over the recording, shape (bands,).
        left: M, shape (bands·outputs, bands·outputs).
    """

    first: IntArray
    left: FloatArray

    def energies(self, products: FloatArray) -> FloatArray:
        """Sums over each band, shape (bands, …), of products of spectra (frequencies, …)."""
        return _energies(self.first, products)

    def densities(self, energies: FloatArray, taken: FloatArray) -> FloatArray:
        """Spectral densities of the noise.

        A low band has few degrees of freedom. Where it shows less than the bands above, as chance
        does as well, the mean with those counts: the noise of sensors grows towards low frequencies
        if anything.

        Args:
            energies: of residuals, shape (bands, outputs, residuals).
            taken: degrees of freedom taken by each residual's own candidate, of the same shape.
        """
        shape, flat = energies.shape, (len(self.left), -1)
        own = np.diag(self.left)[:, None]
        share = np.maximum(1 - taken.reshape(flat) / np.maximum(own, 1e-300), LEAST)
        shown = energies.reshape(flat)
        found = shown / (np.maximum(self.left.sum(1), 1e-300)[:, None] * share)
        for _ in range(ITERATIONS):
            ratio = shown / np.maximum(self.left @ found, 1e-300)
            found *= (self.left.T @ ratio) / np.maximum(self.left.T @ share, 1e-300)
        free = (own * share).reshape(shape)
        return self._supported(found.reshape(shape), free)

    def _supported(self, densities: FloatArray, free: FloatArray) -> FloatArray:
        """Densities, no smaller than the mean over as many bands as have `ENOUGH` freedom."""
        found = densities.copy()
        usual = np.diag(self.left).reshape(free.shape[:2])
        for band, output in np.ndindex(*usual.shape):
            above = np.searchsorted(np.cumsum(usual[band:, output]), ENOUGH) + 1
            together = slice(band, band + int(above))
            weight = free[together, output]
            mean = np.sum(weight * densities[together, output], axis=0) / np.sum(weight, axis=0)
            found[band, output] = np.maximum(found[band, output], mean)
        return found


def spectra(signals: FloatArray) -> ComplexArray:
    """Spectra of signals (samples, …) at every half cycle, shape (samples + 1, …)."""
    return np.asarray(np.fft.rfft(signals, 2 * len(signals), axis=0))


def noise_bands(project: Callable[[FloatArray], FloatArray], counted: BoolArray) -> NoiseBands:
    """The bands of a recording and what a fit leaves of noise in them.

    Args:
        project: removes what the fit takes from signals of shape (samples, outputs, signals).
        counted: samples with a residual, shape (samples, outputs).
    """
    samples, outputs = counted.shape
    first, chance = _bands(samples), np.random.default_rng(1)
    count = max(AGAIN, -(-SIMULATED // samples))
    left = np.zeros((len(first), outputs, len(first), outputs))
    ends = [*first[1:].tolist(), samples + 1]
    for output in range(outputs):
        white = np.fft.rfft(chance.standard_normal((2 * samples, count)), axis=0)
        for band, (begin, end) in enumerate(zip(first.tolist(), ends, strict=True)):
            narrow = np.zeros_like(white)
            narrow[begin:end] = white[begin:end]
            noise = np.zeros((samples, outputs, count))
            noise[:, output] = np.fft.irfft(narrow, axis=0)[:samples]
            rest = spectra(project(noise * counted[..., None]))
            left[:, :, band, output] = _energies(first, np.abs(rest) ** 2).mean(axis=2)
    size = len(first) * outputs
    return NoiseBands(first, left.reshape(size, size))


def _bands(samples: int) -> IntArray:
    """First frequency of each band [half cycles]; a last band that is too narrow is joined."""
    first = [0]
    while (end := first[-1] + max(NARROWEST, first[-1])) <= samples - NARROWEST:
        first.append(end)
    return np.array(first)


def _energies(first: IntArray, products: FloatArray) -> FloatArray:
    """Sums by band over the frequencies of both signs, over the number of frequencies."""
    last = len(products) - 1
    both = np.where(np.isin(np.arange(last + 1), (0, last)), 1.0, 2.0)
    weighted = products * both.reshape(-1, *[1] * (products.ndim - 1))
    return np.asarray(np.add.reduceat(weighted, first, axis=0) / (2 * last))
