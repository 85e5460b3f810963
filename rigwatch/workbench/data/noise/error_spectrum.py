"""The model's own error by frequency, scaled from the healthy motion to another.

A model is checked only where the healthy motion has power. A fault with corners, as a command that
clips or friction that reverses, moves the rig at frequencies that the healthy recording hardly
excites, where the structure and the sensors may respond otherwise than the model. With the healthy
error e_h(f), the healthy reading y_h(f) and the reading y(f) to be explained, as rms of each band,

    e(f) = e_h(f) * max(1, y(f) / y_h(f))

is the error to be expected of a model that is as wrong, relative to the motion, as on the healthy
recording. What an effect leaves within e(f) does not speak against it.

Nor does what it leaves in the highest bands, if they hold little of what is to be explained: there
sensors on their mounts and the structure ring after each jump of a force, as of friction that
reverses, and a healthy motion without jumps has not shown it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from rigwatch.wire.arrays import BoolArray, FloatArray

SEGMENT = 256
"""Samples of a segment of a power spectrum."""
LEAST_SEGMENTS = 8
"""Segments, halfway overlapping, below which a spectrum is too uncertain."""
LITTLE = 0.1
"""Share of the energy to be explained that the highest bands may hold and not count."""
EDGES = np.array([0, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, SEGMENT // 2 + 1])
"""First bin of each band: half an octave wide, the lowest broader."""


@dataclass(frozen=True, eq=False)
class ErrorSpectrum:
    """The error to be expected of the model along a motion.

    Attributes:
        energy: squared rms of the error in each band, shape (bands, outputs).
    """

    energy: FloatArray

    def beyond(
        self, residuals: FloatArray, rms: FloatArray, at: BoolArray | None = None
    ) -> FloatArray:
        """Energy that residuals hold beyond the model's own error, in units of the noise floor.

        Args:
            residuals: of a fit, shape (windows, length, outputs).
            rms: noise floor of each output, shape (outputs,).
            at: samples that count, shape (windows, length); all if None.

        Returns:
            That in each band, the mean over the outputs, shape (bands,); infinite where their
            spectrum cannot be found.
        """
        counted = residuals if at is None else np.where(at[..., None], residuals, 0.0)
        found = band_energy(counted)
        if found is None:
            return np.full(len(self.energy), np.inf)
        share = 1.0 if at is None else _share(residuals, at)
        return np.asarray(np.mean(np.maximum(found / share - self.energy, 0.0) / rms**2, axis=1))


def that_count(energy: FloatArray) -> BoolArray:
    """The bands that count: all but the highest that together hold at most `LITTLE` of the energy.

    Args:
        energy: to be explained in each band, shape (bands,).
    """
    above = np.cumsum(energy[::-1])[::-1]
    return np.asarray(above > LITTLE * above[0])


def _share(residuals: FloatArray, at: BoolArray) -> float:
    """Share of the samples of a spectrum that count: invalid ones are in none, unless set to 0."""
    valid = np.isfinite(residuals).all(axis=-1)
    return float((at & valid).sum() / max(int((valid | ~at).sum()), 1))


def expected_error(
    residuals: FloatArray, healthy: FloatArray, reading: FloatArray, factor: int = 1
) -> ErrorSpectrum | None:
    """The model's own error along a motion; None if a recording is too short or too broken.

    Args:
        residuals: of the model on the healthy recording, shape (windows, length, outputs).
        healthy: outputs of the healthy recording, shape (n, outputs).
        reading: outputs of the recording to be explained, shape (m, outputs).
        factor: decimation of the residuals, which the outputs do not have.
    """
    error = band_energy(residuals)
    least, motion = (band_energy(each, factor) for each in (healthy, reading))
    if error is None or least is None or motion is None:
        return None
    larger = np.maximum(motion / np.maximum(least, 1e-300), 1.0)
    return ErrorSpectrum(error * larger)


def band_energy(signals: FloatArray, finer: int = 1) -> FloatArray | None:
    """Squared rms of signals in each band, shape (bands, outputs).

    Args:
        signals: shape (n, outputs) or (windows, length, outputs); windows follow one another.
        finer: samples of the signals in one of those whose bands are taken.

    Returns:
        None if too few whole segments hold valid samples only.
    """
    series = signals.reshape(-1, signals.shape[-1])
    series = series[np.isfinite(series).all(axis=1)]
    if len(series) < finer * SEGMENT * (LEAST_SEGMENTS + 1) // 2:
        return None
    _, power = welch(series, nperseg=finer * SEGMENT, axis=0, detrend=False, scaling="spectrum")
    # Of a Hann window, whose equivalent noise bandwidth is 1.5 bins.
    return np.asarray(np.add.reduceat(power[: EDGES[-1]] / 1.5, EDGES[:-1], axis=0))
