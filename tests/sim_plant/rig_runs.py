"""Runs that several tests share."""

import numpy as np
from numpy.typing import NDArray

from sim_plant.excitation import Sine, drive
from sim_plant.parameters import RigParameters
from sim_plant.rig import RawSamples, Rig

RATE = 256.0

SEALED = RigParameters(port_resistance=1e18, piston_leak=0.0, piston_viscous=0.0, centring_gain=0.0)
"""No air passes in or out: the load swings on two closed air springs."""


def sine(
    amplitude: float, frequency: float, seconds: float, start: float = 0.0
) -> NDArray[np.float64]:
    """Volts of a sine, ramped in at time 0."""
    numbers = np.arange(round(start * RATE), round((start + seconds) * RATE), dtype=np.int64)
    return drive(Sine(amplitude=amplitude, frequency=frequency), RATE)(numbers)


def settled(
    amplitude: float,
    frequency: float,
    effects: dict[str, float] | None = None,
    parameters: RigParameters | None = None,
    seconds: float = 6.0,
) -> RawSamples:
    """Samples of a sine drive, effects set once it runs, after 6 s of settling with each."""
    rig = Rig(parameters or RigParameters(), seed=3)
    rig.advance(sine(amplitude, frequency, 6.0))
    for name, value in (effects or {}).items():
        rig.set_effect(name, value)
    rig.advance(sine(amplitude, frequency, 6.0, start=6.0))
    return rig.advance(sine(amplitude, frequency, seconds, start=12.0))


def gain(samples: RawSamples, frequency: float, output: str = "x") -> complex:
    """Response of a true value to the drive voltage at one frequency (a whole number of cycles)."""
    turning = np.exp(-2j * np.pi * frequency * np.arange(len(samples)) / RATE)
    truth = samples.truth
    return complex((truth[output] * turning).sum() / (truth["voltage"] * turning).sum())
