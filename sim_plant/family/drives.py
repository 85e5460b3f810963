"""Voltages of the generator: shapes over its own time, started, stopped and changed.

The generator's time runs at the DAQ's rate when it is locked; a free one is off by a share that
may drift. Its voltage is held from sample to sample, as a converter does at the sample rate, or
moves between samples.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.family.kernel import SUBSTEPS
from sim_plant.family.member import RATE, Member

Floats = NDArray[np.float64]
MULTISINE_S = 8.0
"""Period of the multisine [s]."""


@dataclass(frozen=True, slots=True)
class Drive:
    """A generator's signal.

    Args:
        shape: sine, square, triangle, chirp, multisine or noise.
        volts: amplitude; rms of multisine and noise.
        hz: frequency of periodic shapes.
        seed: of the phases of multisine and noise.
        free: the generator has its own clock.
        changes: (second, factor on the voltage, factor on the frequency), from then on; a factor
            of 0 stops the drive, and the next one restarts it with its ramp.
        loop: a controller adds to the voltage.
    """

    shape: str
    volts: float
    hz: float = 0.0
    seed: int = 0
    free: bool = False
    changes: tuple[tuple[float, float, float], ...] = ()
    loop: bool = False


def voltage(drive: Drive, member: Member, seconds: float) -> Floats:
    """Volts at every step of every sample, shape (n, SUBSTEPS)."""
    n = round(seconds * RATE)
    steps = SUBSTEPS if member.flavour.smooth_generator else 1
    t = np.arange(n * steps) / (RATE * steps)
    drift = member.clock_drift if drive.free else 0.0
    own = t * (1 + (member.clock if drive.free else 0.0)) + 0.5 * drift * t**2
    size, pace = _schedule(drive, member.ramp_s, t)
    # Frequency changes keep the phase: the generator's time is the integral of its pace.
    playing = np.concatenate([[0.0], np.cumsum(pace[:-1] * np.diff(own))])
    volts = drive.volts * size * _wave(drive, playing, seconds)
    return np.repeat(volts.reshape(n, steps), SUBSTEPS // steps, axis=1)


def _schedule(drive: Drive, ramp_s: float, t: Floats) -> tuple[Floats, Floats]:
    """Factors on voltage and frequency over time; every start has its ramp."""
    size, pace = np.ones(t.size), np.ones(t.size)
    started, before = 0.0, 0.0
    ramp = np.ones(t.size)
    for second, factor, faster in ((0.0, 1.0, 1.0), *drive.changes):
        after = t >= second
        size[after], pace[after] = factor, faster
        if before == 0.0 and factor > 0.0:
            started = second
            ramp[after] = np.clip((t[after] - started) / ramp_s, 0.0, 1.0) if ramp_s else 1.0
        before = factor
    return size * ramp, pace


def _wave(drive: Drive, t: Floats, seconds: float) -> Floats:
    cycle = drive.hz * t
    match drive.shape:
        case "sine":
            return np.asarray(np.sin(2 * np.pi * cycle))
        case "square":
            return np.where((cycle + 1e-9) % 1.0 < 0.5, 1.0, -1.0)
        case "triangle":
            return np.asarray(1.0 - 4.0 * np.abs((cycle + 0.25) % 1.0 - 0.5))
        case "chirp":
            # From 1 Hz to 20 Hz.
            return np.asarray(np.sin(2 * np.pi * (t + 0.5 * 19.0 / seconds * t**2)))
        case "multisine":
            return _lines(np.arange(3, 160, 2), MULTISINE_S, drive.seed, t)
        case "noise":
            lines = np.arange(round(0.5 * seconds), round(14.0 * seconds))
            return _lines(lines, seconds, drive.seed, t)
        case _:
            raise ValueError(f"shape {drive.shape!r}")


def _lines(lines: NDArray[np.int64], period: float, seed: int, t: Floats) -> Floats:
    """Lines of equal height and random phase with an rms of 1, repeated every `period` [s]."""
    step = t[1] - t[0]
    count = round(period / step)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines.size)
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(1j * phases)
    wave = np.fft.irfft(spectrum, count)
    wave /= np.sqrt(np.mean(wave**2))
    return np.asarray(wave[np.rint(t / step).astype(np.int64) % count])
