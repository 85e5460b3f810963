"""Output-error model by the prediction error method (5.29); L. Ljung, System Identification,
chapters 7 and 10.

    ŷ(t) = q⁻ⁿᵏ·B(q⁻¹)/F(q⁻¹)·u(t),   min over B, F of Σ (y - ŷ)²

The gradient is filtered data: ∂ŷ/∂b_k = q⁻ᵏ/F·u and ∂ŷ/∂f_k = -q⁻ᵏ/F·ŷ. The search starts from the
best of several Steiglitz-McBride iterations, runs Gauss-Newton with Levenberg's damping, and keeps
F stable throughout.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from rigwatch.physics.transfer.levenberg import (
    Descent,
    descend,
    least_squares_coefficients,
)
from rigwatch.physics.transfer.transfer_function import TransferFunction, reflected
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

START_ROUNDS = 12
DESCENT = Descent(steps=60, more=10.0, less=10.0, worth=1e-10)


@dataclass(frozen=True)
class OutputErrorOrders:
    """[nb, nf, nk]: coefficients of B, order of F, delay [samples]."""

    nb: int
    nf: int
    nk: int


@dataclass(frozen=True, eq=False)
class OutputErrorFit:
    """Result of the fit.

    Args:
        function: B/F, stable.
        error_norm: ‖y - ŷ‖₂ over the scored samples, unit of y.
        explained: share of the energy of y that is explained, 1 is all.
    """

    function: TransferFunction
    error_norm: float
    explained: float


def fit_output_error(
    u: FloatArray, y: FloatArray, orders: OutputErrorOrders, skip: int = 0
) -> OutputErrorFit:
    """Fit [nb, nf, nk] to input `u` and output `y`, both from rest.

    Args:
        u, y: shape (n,), finite.
        orders: of the model.
        skip: first samples that are simulated but not scored [samples].

    Raises:
        ModelError: too few samples, input or output of zeros, or every start diverges.
    """
    if u.size - skip < 4 * (orders.nb + orders.nf):
        raise ModelError(
            f"output-error model: found {u.size - skip} samples, "
            f"expected at least {4 * (orders.nb + orders.nf)}"
        )
    if not (np.any(u) and np.any(y)):
        raise ModelError("output-error model: found an input or output of zeros")
    search = _Search(u, y, orders, skip)
    theta = search.descend(search.start())
    error = search.errors(theta)
    energy = float(np.sum(y[skip:] ** 2))
    return OutputErrorFit(
        search.function(theta),
        float(np.linalg.norm(error)),
        1.0 - float(np.sum(error**2)) / energy,
    )


class _Search:
    """The sum of squares over θ = (b_0 … b_nb-1, f_1 … f_nf)."""

    def __init__(self, u: FloatArray, y: FloatArray, orders: OutputErrorOrders, skip: int) -> None:
        self.u, self.y, self.skip, self.orders = u, y, skip, orders

    def function(self, theta: FloatArray) -> TransferFunction:
        nb, nk = self.orders.nb, self.orders.nk
        return TransferFunction.of(
            np.concatenate([np.zeros(nk), theta[:nb]]), np.concatenate([[1.0], theta[nb:]])
        )

    def start(self) -> FloatArray:
        """The best Steiglitz-McBride iterate from two starts."""
        candidates = [*self._rounds(np.zeros(self.orders.nf)), *self._rounds(self._slow_poles())]
        costs = [self.cost(theta) for theta in candidates]
        best = int(np.argmin(costs))
        if not np.isfinite(costs[best]):
            raise ModelError("output-error model: no start gives a finite error")
        return candidates[best]

    def _slow_poles(self) -> FloatArray:
        return np.asarray(np.poly(np.full(self.orders.nf, 0.9))[1:])

    def _rounds(self, f: FloatArray) -> list[FloatArray]:
        found = []
        for _ in range(START_ROUNDS):
            theta = self._linear(f)
            f = theta[self.orders.nb :]
            found.append(theta)
        return found

    def _linear(self, f: FloatArray) -> FloatArray:
        """F·y = B·u with both signals filtered by the last 1/F, then B alone for the kept F."""
        a = np.concatenate([[1.0], f])
        filtered_u, filtered_y = (
            scipy.signal.lfilter([1.0], a, self.u),
            scipy.signal.lfilter([1.0], a, self.y),
        )
        columns = self._delays(filtered_u, self._input_delays())
        columns += [-c for c in self._delays(filtered_y, range(1, self.orders.nf + 1))]
        theta = least_squares_coefficients(
            np.column_stack(columns)[self.skip :], filtered_y[self.skip :]
        )
        stable = reflected(np.concatenate([[1.0], theta[self.orders.nb :]]), 1e-4)
        return np.concatenate([self._best_numerator(stable), stable[1:]])

    def _best_numerator(self, a: FloatArray) -> FloatArray:
        filtered = scipy.signal.lfilter([1.0], a, self.u)
        columns = np.column_stack(self._delays(filtered, self._input_delays()))
        return least_squares_coefficients(columns[self.skip :], self.y[self.skip :])

    def _input_delays(self) -> range:
        return range(self.orders.nk, self.orders.nk + self.orders.nb)

    @staticmethod
    def _delays(signal: FloatArray, delays: range) -> list[FloatArray]:
        return [np.concatenate([np.zeros(d), signal[: signal.size - d]]) for d in delays]

    def errors(self, theta: FloatArray) -> FloatArray:
        model = self.function(theta)
        return np.asarray((self.y - scipy.signal.lfilter(model.b, model.a, self.u))[self.skip :])

    def cost(self, theta: FloatArray) -> float:
        cost = float(np.sum(self.errors(theta) ** 2))
        return cost if np.isfinite(cost) else np.inf

    def gradient(self, theta: FloatArray) -> FloatArray:
        model = self.function(theta)
        filtered_u = scipy.signal.lfilter([1.0], model.a, self.u)
        filtered_y = scipy.signal.lfilter(
            [1.0], model.a, scipy.signal.lfilter(model.b, model.a, self.u)
        )
        columns = self._delays(filtered_u, self._input_delays())
        columns += [-c for c in self._delays(filtered_y, range(1, self.orders.nf + 1))]
        return np.column_stack(columns)[self.skip :]

    def descend(self, theta: FloatArray) -> FloatArray:
        return descend(
            theta,
            DESCENT,
            errors=self.errors,
            gradient=self.gradient,
            cost=self.cost,
            admissible=self._stable,
        )

    def _stable(self, theta: FloatArray) -> FloatArray:
        nb, stable = self.orders.nb, theta.copy()
        stable[nb:] = reflected(np.concatenate([[1.0], theta[nb:]]), 1e-4)[1:]
        return stable
