"""The friction filter: how friction at the mass reaches the residual (docs/theory.md 1.3).

    a_r(t) = Ge(q⁻¹)·[ sgn(v) + γf·v ] + e(t)                                              (5.29)

Ge is an output-error model fitted to a stretch with a known friction fault; γf [s/m] is scanned
and the pair with the smallest ‖e‖₂ wins. The fault's signature is then (θ1, θ2) = (1, γf).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.transfer import (
    OutputErrorFit,
    OutputErrorOrders,
    TransferFunction,
    fit_output_error,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

RIG_ORDERS = OutputErrorOrders(4, 3, 0)
GAMMAS = tuple(float(gamma) for gamma in np.round(np.arange(0.0, 10.01, 0.2), 1))


@dataclass(frozen=True, eq=False)
class FrictionFilter:
    """Ge with its signature.

    Args:
        function: Ge, from sgn(v) + γf·v to the residual [m/s^2].
        gamma: γf [s/m].
        explained: share of the residual's energy that it explains, 1 is all.
        coulomb: θ1 of the signature: 1, or 0 if the known fault is purely viscous.
    """

    function: TransferFunction
    gamma: float
    explained: float
    coulomb: float = 1.0


def fit_friction_filter(  # noqa: PLR0917
    velocity: FloatArray,
    residual: FloatArray,
    orders: OutputErrorOrders = RIG_ORDERS,
    gammas: Iterable[float] = GAMMAS,
    skip: int = 50,
    coulomb: float = 1.0,
) -> FrictionFilter:
    """Ge and γf from one stretch with a known friction fault.

    Args:
        velocity: [m/s], shape (n,).
        residual: a_r [m/s^2], shape (n,).
        orders: of the output-error model.
        gammas: values of γf to try [s/m].
        skip: number of first samples not scored, while the filter settles.
        coulomb: weight of sgn(v); 0 for a purely viscous known fault.

    Raises:
        ModelError: no γf gives a filter.
    """
    best: tuple[OutputErrorFit, float] | None = None
    sign = np.sign(velocity)
    for gamma in gammas:
        fit = fit_output_error(coulomb * sign + gamma * velocity, residual, orders, skip)
        if best is None or fit.error_norm < best[0].error_norm:
            best = (fit, gamma)
    if best is None:
        raise ModelError("friction filter: found no value of gamma to try")
    return FrictionFilter(best[0].function, best[1], best[0].explained, coulomb)
