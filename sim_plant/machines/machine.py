"""A machine's log: sensor signals with noise and the quantization of a converter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.machines import cascade, damper, motor, pendulum, tanks
from sim_plant.oscillator import EFFECTS as OSCILLATOR_EFFECTS
from sim_plant.oscillator import RATE as OSCILLATOR_RATE
from sim_plant.oscillator import Hidden, oscillate
from sim_plant.strengths import strength_that_causes

STEP = 0.3
"""Quantization step of a sensor's converter, relative to its noise."""
FINEST = 2e-5
"""Smallest step of a converter, relative to the rms of its signal: 16 bits."""
BETTER = 0.05
"""Noise of a sensor whose signal is an input of the model, relative to that of the others."""


@dataclass(frozen=True)
class Machine:
    """A machine on a bench.

    Attributes:
        rate: samples a second.
        columns: columns of its log without the time, with units as loggers write them.
        commanded: number of leading columns that are commands, which have no noise.
        precise: number of following columns that come from more accurate sensors.
        effects: names of the effects that can be hidden.
        drive: a random excitation, from a seed.
        run: noise-free columns for an excitation and strengths of effects; that of a machine whose
            log may have any clock takes the times from sample to sample too.
        any_clock: whether it does.
    """

    rate: float
    columns: tuple[str, ...]
    commanded: int
    precise: int
    effects: tuple[str, ...]
    drive: Callable[[int], FloatArray]
    run: Callable[..., FloatArray]
    any_clock: bool = False


def strength_for(machine: Machine, effect: str, share: float, seed: int) -> float:
    """The strength at which an effect changes the outputs by `share` of their rms.

    Args:
        machine: the machine, with nothing else hidden.
        effect: one of its effects.
        share: for example 0.1.
        seed: of the excitation.
    """
    excitation, first = machine.drive(seed), machine.commanded + machine.precise
    return strength_that_causes(
        share, lambda strength: machine.run(excitation, {effect: strength})[:, first:]
    )


def log(
    machine: Machine,
    hidden: Mapping[str, float],
    noise: float,
    seed: int,
    spans: FloatArray | None = None,
) -> dict[str, FloatArray]:
    """A recording as a logger writes it: time and columns, each of shape (n,).

    Args:
        machine: the machine.
        hidden: strengths of the hidden effects, by name.
        noise: standard deviation of the sensors' noise, relative to the rms of their signals.
        seed: of excitation and noise.
        spans: time from each sample to the next, for a machine with `any_clock`, shape (n,) [s];
            of the machine's rate where None.
    """
    drive, random = machine.drive(seed), np.random.default_rng([seed, 1])
    clean = machine.run(drive, hidden) if spans is None else machine.run(drive, hidden, spans)
    table = {"time_s": np.arange(len(clean)) / machine.rate}
    if spans is not None:
        table["time_s"] = np.concatenate([[0.0], np.cumsum(spans[:-1])])
    for index, name in enumerate(machine.columns):
        level = noise * (BETTER if index < machine.commanded + machine.precise else 1.0)
        signal = clean[:, index]
        table[name] = signal if index < machine.commanded else _read(signal, level, random)
    return table


def _read(signal: FloatArray, level: float, random: np.random.Generator) -> FloatArray:
    """A signal with noise, in steps of the converter."""
    size = float(np.std(signal))
    step = size * max(STEP * level, FINEST)
    noisy = signal + level * size * random.standard_normal(len(signal))
    return np.asarray(step * np.round(noisy / step))


def _strengths(effects: tuple[str, ...], hidden: Mapping[str, float]) -> FloatArray:
    return np.array([hidden.get(name, 0.0) for name in effects])


def _driven(plant: ModuleType, outputs: int) -> Callable[..., FloatArray]:
    """A plant whose log is its command and its outputs."""

    def run(
        command: FloatArray, hidden: Mapping[str, float], spans: FloatArray | None = None
    ) -> FloatArray:
        out = np.empty((len(command), outputs))
        even = np.full(len(command), 1.0 / plant.RATE)
        plant.run(command, _strengths(plant.EFFECTS, hidden), out, even if spans is None else spans)
        return np.column_stack([command, out])

    return run


def _damper(path: FloatArray, hidden: Mapping[str, float]) -> FloatArray:
    out = np.empty((len(path) // damper.STEPS, 2))
    damper.run(path, _strengths(damper.EFFECTS, hidden), out)
    return out


def _oscillator(force: FloatArray, hidden: Mapping[str, float]) -> FloatArray:
    faults = tuple(Hidden(name, strength) for name, strength in hidden.items() if strength)
    return np.column_stack([force, oscillate(force, faults, np.zeros(2), 0)])


def _force(seed: int) -> FloatArray:
    """Multisine force from 0.25 to 8 Hz with random phases, rms 4 N, shape (3072,)."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 31)
    time, lines = np.arange(3072) / OSCILLATOR_RATE, np.arange(0.25, 8, 0.25)
    return np.asarray(
        4 * np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(1) / np.sqrt(31 / 2)
    )


MACHINES: dict[str, Machine] = {
    "oscillator": Machine(
        OSCILLATOR_RATE, ("force_N", "position_m", "acceleration_m_s2"), 1, 0,
        OSCILLATOR_EFFECTS, _force, _oscillator,
    ),
    "motor": Machine(
        motor.RATE, ("voltage_V", "speed_rad_s"), 1, 0,
        motor.EFFECTS, motor.drive, _driven(motor, 1), any_clock=True,
    ),
    "pendulum": Machine(
        pendulum.RATE, ("voltage_V", "angle_rad"), 1, 0,
        pendulum.EFFECTS, pendulum.drive, _driven(pendulum, 1), any_clock=True,
    ),
    "damper": Machine(
        damper.RATE, ("displacement_m", "force_N"), 0, 1, damper.EFFECTS, damper.drive, _damper
    ),
    "tanks": Machine(
        tanks.RATE, ("voltage_V", "level1_m", "level2_m"), 1, 0,
        tanks.EFFECTS, tanks.drive, _driven(tanks, 2), any_clock=True,
    ),
    "cascade": Machine(
        cascade.RATE, ("voltage_V", "level_m"), 1, 0,
        cascade.EFFECTS, cascade.drive, _driven(cascade, 1), any_clock=True,
    ),
}  # fmt: skip
"""The machines by name."""
