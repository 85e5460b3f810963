"""The second-order plant of the numerical validation (docs/theory.md 1.5).

    m dv/dt = u - k x - c v - alpha sgn(v),   dx/dt = v,   u = 3 sin(2 pi 4 t)

m = 1, k = 1, c = 2.2; from t = 10 s on a fault adds alpha and to c. Units are left out, as in the
thesis. A step is split: half a step of dry friction (an impulse that cannot reverse the
velocity), the exact solution of the linear part for an input held at its middle, half a step of dry
friction. It is of second order and sticks exactly.
"""

# numba's functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from rigwatch.wire.kernel import kernel, part

Floats = NDArray[np.float64]

MASS, STIFFNESS, DAMPING = 1.0, 1.0, 2.2
AMPLITUDE, FREQUENCY = 3.0, 4.0
STEP, LENGTH, FAULT_TIME = 0.005, 20.0, 10.0
NOISE = 0.02
"""Half width of the uniform noise, as a share of each signal's peak before the fault."""
_SUBSTEPS = 20


@dataclass(frozen=True, slots=True)
class Fault:
    """Added dry and viscous friction from `FAULT_TIME` on."""

    coulomb: float
    viscous: float


CASES: dict[int, Fault] = {1: Fault(0.0, 7.0), 2: Fault(1.0, 0.0), 3: Fault(1.0, 1.0)}
"""The three published cases."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Signals of one case, each of shape (4000,); "measured" ones carry noise, the others do not.

    `healthy` signals come from the plant without the fault, `faulty` ones from the plant with it.
    """

    time: Floats
    input: Floats
    acceleration_healthy: Floats
    acceleration_faulty: Floats
    acceleration_measured: Floats
    velocity_measured: Floats


def validation(case: int, seed: int) -> Validation:
    """The case 1, 2 or 3 of the thesis, with the noise of `seed`."""
    time = _grid(round(LENGTH / STEP), STEP)
    healthy, faulty = simulate(Fault(0.0, 0.0)), simulate(CASES[case])
    random = np.random.default_rng(seed)
    return Validation(
        time=time,
        input=_input(time),
        acceleration_healthy=healthy[:, 2],
        acceleration_faulty=faulty[:, 2],
        acceleration_measured=_noisy(faulty[:, 2], time, random),
        velocity_measured=_noisy(faulty[:, 1], time, random),
    )


def simulate(fault: Fault) -> Floats:
    """Position, velocity and acceleration at the 4000 sample times; shape (4000, 3)."""
    count, fine = round(LENGTH / STEP), STEP / _SUBSTEPS
    middles = _grid(count * _SUBSTEPS, fine) + 0.5 * fine
    begins = round(FAULT_TIME / STEP)
    out = np.empty((count, 3))
    state = np.zeros(2)
    at_samples = _input(_grid(count, STEP))
    for span, add in ((slice(0, begins), Fault(0.0, 0.0)), (slice(begins, count), fault)):
        fine_span = slice(span.start * _SUBSTEPS, span.stop * _SUBSTEPS)
        damping = DAMPING + add.viscous
        matrix, gain = _exact(damping, fine)
        settings = np.array([MASS, STIFFNESS, damping, add.coulomb, fine])
        inputs = (_input(middles[fine_span]), at_samples[span])
        _run(state, matrix, gain, *inputs, settings, out[span])
    return out


def _grid(count: int, step: float) -> Floats:
    return np.arange(count, dtype=np.float64) * step


def _input(time: Floats) -> Floats:
    return np.asarray(AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * time))


def _exact(damping: float, step: float) -> tuple[Floats, Floats]:
    """Transition matrix and input gain of the linear plant over `step`."""
    system = np.zeros((3, 3))
    system[:2] = [[0.0, 1.0, 0.0], [-STIFFNESS / MASS, -damping / MASS, 1.0 / MASS]]
    whole = np.asarray(expm(system * step), dtype=np.float64)
    return whole[:2, :2].copy(), whole[:2, 2].copy()


def _noisy(signal: Floats, time: Floats, random: np.random.Generator) -> Floats:
    width = NOISE * float(np.abs(signal[time < FAULT_TIME]).max())
    return signal + random.uniform(-width, width, signal.size)


@part()
def _braked(velocity: float, impulse: float) -> tuple[float, float]:
    """The velocity after dry friction, which cannot reverse it, and the rest of `impulse`."""
    used = min(abs(velocity), impulse)
    return velocity - math.copysign(used, velocity), impulse - used


@kernel()
def _run(  # noqa: PLR0917
    state: Floats,
    matrix: Floats,
    gain: Floats,
    middles: Floats,
    inputs: Floats,
    settings: Floats,
    out: Floats,
) -> None:
    """Steps through one part of the record and updates `state` (x, v)."""
    mass, stiffness, damping, coulomb, step = settings
    impulse = 0.5 * coulomb * step / mass
    fine = middles.size // inputs.size
    x, v = state[0], state[1]
    for sample in range(inputs.size):
        force = inputs[sample] - stiffness * x - damping * v
        toward = v if v != 0.0 else force
        friction = np.sign(toward) * (coulomb if v != 0.0 else min(coulomb, abs(force)))
        out[sample, 0], out[sample, 1], out[sample, 2] = x, v, (force - friction) / mass
        for sub in range(fine):
            u = middles[sample * fine + sub]
            v, left = _braked(v, impulse)
            moved = matrix[0, 0] * x + matrix[0, 1] * v + gain[0] * u
            v = matrix[1, 0] * x + matrix[1, 1] * v + gain[1] * u
            # A mass at rest used no impulse in the first half: the whole impulse holds it.
            v, left = _braked(v, impulse + left)
            x = moved
    state[0], state[1] = x, v
