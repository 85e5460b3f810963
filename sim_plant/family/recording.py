"""Plays a scenario on a member: voltage, position and acceleration as its DAQ records them."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sim_plant.family import kernel
from sim_plant.family.drives import voltage
from sim_plant.family.member import RATE, Member, at_rest
from sim_plant.family.scenarios import Scenario

Floats = NDArray[np.float64]


def play(member: Member, name: str, scenario: Scenario) -> Floats:
    """Time [s], voltage [V], position [m], acceleration [m/s^2]; shape (n, 4).

    Noise comes from the member's seed and the recording's `name`.
    """
    volts = voltage(scenario.drive, member, scenario.seconds)
    n = len(volts)
    random = np.random.default_rng([member.seed, 1, *name.encode()])
    out = np.empty((n, 4))
    out[:, 0] = np.arange(n) / RATE
    onset = round((scenario.from_s or 0.0) * RATE)
    measured = np.empty((n, 3))
    kernel.simulate(
        volts,
        member.feedback if scenario.drive.loop else 0.0,
        random.standard_normal((n, 2)) * member.noise,
        np.array(member.late),
        kernel.hidden_effects(scenario.hidden),
        onset,
        member.record,
        _start(member, scenario),
        RATE,
        measured,
    )
    measured[:, 2] = _smoothed(measured[:, 2], member.smoothing)
    if scenario.sensor:
        _break(measured, onset, *scenario.sensor, random)
    if not np.isfinite(measured).all():
        raise FloatingPointError(f"{member.name}, {name}: a value that is not finite")
    out[:, 1:] = measured
    return out


def _start(member: Member, scenario: Scenario) -> Floats:
    """States at rest; with effects present from the start, the equilibrium includes them."""
    if scenario.hidden and not scenario.from_s:
        return at_rest(member, scenario.hidden)
    return member.rest.copy()


def _smoothed(a: Floats, weight: float) -> Floats:
    """First-order digital filter with `weight` of the newest sample."""
    if weight == 1.0:
        return a
    smoothed, _ = lfilter([weight], [1.0, weight - 1.0], a, zi=[(1.0 - weight) * a[0]])
    return np.asarray(smoothed)


def _break(
    measured: Floats, onset: int, kind: str, value: float, random: np.random.Generator
) -> None:
    """Puts the sensor fault `kind` into position or acceleration from the sample `onset` on."""
    x, a = measured[onset:, 1], measured[onset:, 2]
    match kind:
        case "gain":
            a *= value
        case "stuck":
            a[:] = a[0]
        case "noise":
            a += value * random.standard_normal(a.size)
        case "bias":
            x += value
        case "delay":
            a[1:] = a[:-1].copy()
        case "smoothing":
            a[:] = _smoothed(a, value)
        case _:
            raise ValueError(f"sensor fault {kind!r}")
