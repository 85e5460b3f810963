"""A mass on a spring in closed form, with its resonance within the force's 0.25 to 16 Hz.

The force is linear between samples or held, so the exact step from sample to sample is a matrix
exponential.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from rigwatch.wire.arrays import FloatArray

RATE, SAMPLES = 256.0, 5120
"""Sample rate [Hz], and samples in a recording."""


@dataclass(frozen=True)
class Mass:
    """A mass on a spring: mass [kg], damper [N s/m], spring [N/m]."""

    m: float
    c: float
    k: float

    @property
    def values(self) -> FloatArray:
        """Mass, damper and spring, shape (3,)."""
        return np.array([self.m, self.c, self.k])


def moved(mass: Mass, force: FloatArray, *, held: bool) -> FloatArray:
    """Position [m] and acceleration [m/s^2] at the samples, from rest; shape (n, 2).

    Args:
        mass: the mass and its spring.
        force: at the samples, shape (n,) [N].
        held: whether it is constant between samples; else a line joins them.
    """
    whole = np.zeros((4, 4))
    whole[0, 1] = 1.0
    whole[1, :3] = -mass.k / mass.m, -mass.c / mass.m, 1 / mass.m
    whole[2, 3] = 1.0
    step = expm(whole / RATE)[:2]
    slope = np.diff(force, append=force[-1]) * RATE * (not held)
    state, states = np.zeros(2), np.empty((len(force), 2))
    for index, pushed in enumerate(zip(force, slope, strict=True)):
        states[index] = state
        state = step @ np.concatenate([state, pushed])
    balance = force - mass.c * states[:, 1] - mass.k * states[:, 0]
    return np.column_stack([states[:, 0], balance / mass.m])


def excitation(generator: np.random.Generator) -> FloatArray:
    """Force with lines from 0.25 to 16 Hz, rms 4 N, shape (SAMPLES,)."""
    lines, seconds = np.arange(0.25, 16, 0.25), np.arange(SAMPLES) / RATE
    phases = generator.uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(seconds, lines) + phases).sum(axis=1)
    return np.asarray(4 * waves / np.sqrt(len(lines) / 2))
