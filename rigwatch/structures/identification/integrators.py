"""Explicit Runge-Kutta methods for the linear sweep of quasilinearization, one step per sample.

    z ← z + h·Σ_j b_j·k_j,   k_j = rate(t + c_j·h, z + h·Σ_l a_jl·k_l)

`dormand-prince` reproduces the thesis: Simulink's default for a fixed step (its `ode5`), fed with
x, x² and x³ of the record as separate signals, each linear between samples. Of all methods and
interpolations tried, it alone gives the printed first iterations of Tables 4.1 to 4.6, to all
printed digits. As the interpolated x² is not the square of the interpolated x, its nonlinear
coefficients converge to values 1 to 2 % too high at h = 0.01 s.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class Integrator:
    """A method's coefficients.

    Attributes:
        a: shape (stages, stages), strictly lower triangle.
        b: shape (stages,).
        c: shape (stages,).
        apart: whether rates, not states, are interpolated linearly between samples.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    apart: bool


def _integrator(rows: list[list[float]], b: list[float], *, apart: bool) -> Integrator:
    a = np.zeros((len(b), len(b)))
    for stage, row in enumerate(rows):
        a[stage, : len(row)] = row
    return Integrator(a, np.array(b), a.sum(axis=1), apart)


CLASSICAL = _integrator(
    [[], [1 / 2], [0, 1 / 2], [0, 0, 1]],
    [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    apart=False,
)
DORMAND_PRINCE = _integrator(
    [
        [],
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    apart=True,
)
"""J. R. Dormand and P. J. Prince, J. Comp. Appl. Math. 6 (1980), fifth order."""
INTEGRATORS = {"runge-kutta": CLASSICAL, "dormand-prince": DORMAND_PRINCE}


def integrator(name: str) -> Integrator:
    """The method with that name.

    Raises:
        ModelError: no such method.
    """
    if name not in INTEGRATORS:
        expected = " or ".join(INTEGRATORS)
        raise ModelError(f"integrator: found {name!r}, expected {expected}")
    return INTEGRATORS[name]
