"""Common parts of all specimens: multisine drives, integration steps, sensor noise."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import FloatArray

NOISE = 1e-3
"""Standard deviation of each sensor's noise, relative to that of its signal."""

March = Callable[[FloatArray, float, str], FloatArray]
"""Inputs (n, inputs), time between samples [s] and the hidden effect, none if empty → outputs."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording of a specimen.

    Attributes:
        dt: time between samples [s].
        inputs: shape (n, inputs), in the model's units and order.
        outputs: shape (n, outputs).
    """

    dt: float
    inputs: FloatArray
    outputs: FloatArray


@dataclass(frozen=True)
class Machine:
    """A machine with drives and sensors.

    Attributes:
        model: name of its model.
        rate: samples a second [Hz].
        drive: time (n,) [s] and a seed → inputs (n, inputs).
        march: integrates it.
    """

    model: str
    rate: float
    drive: Callable[[FloatArray, int], FloatArray]
    march: March


@dataclass(frozen=True)
class Specimen:
    """A machine with one effect of the library to be hidden in it.

    Attributes:
        machine: the machine.
        hidden: the effect that can be hidden.
        named: effects at ports by which a workbench names it.
        known: effects at ports that the model needs to have already.
    """

    machine: Machine
    hidden: str
    named: tuple[str, ...]
    known: tuple[str, ...] = ()

    def record(self, seed: int, *, hidden: bool, samples: int = 1024) -> Recorded:
        """One recording, healthy or not."""
        dt = 1 / self.machine.rate
        inputs = self.machine.drive(dt * np.arange(samples, dtype=np.float64), seed)
        clean = self.machine.march(inputs, dt, self.hidden if hidden else "")
        spread = NOISE * clean.std(axis=0)
        noise = np.random.default_rng(seed + 99).normal(size=clean.shape)
        return Recorded(dt, inputs, clean + spread * noise)


def sines(
    time: FloatArray, lines: FloatArray, size: float, seed: int, middle: float = 0.0
) -> FloatArray:
    """Sines of these frequencies [Hz] with phases of a seed about a middle, rms `size`; (n,)."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    waves = np.sin(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    return np.asarray(middle + size * waves / np.sqrt(len(lines) / 2))


def between(inputs: FloatArray, row: int, share: float) -> list[float]:
    """Inputs between two samples, along a straight line."""
    first, second = inputs[row], inputs[min(row + 1, len(inputs) - 1)]
    return [float(a + share * (b - a)) for a, b in zip(first, second, strict=True)]
