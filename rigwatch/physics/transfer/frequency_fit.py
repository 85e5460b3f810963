"""Transfer function from a frequency response by weighted least squares (5.16), (5.19).

    min over θ of Σ | (B(z⁻¹)/A(z⁻¹) - G)·W |²,   z = exp(jωT)

Three steps: Levy's linear problem |A·G - B|²·W² gives a start; Sanathanan and Koerner's iteration
divides its weight by the last |A|, which removes Levy's bias to high frequencies; Gauss-Newton
with Levenberg's damping minimises (5.19) itself. Poles that leave the unit circle are reflected
into it after each step.
"""

import numpy as np
from numpy.typing import NDArray

from rigwatch.physics.transfer.frequency_response import FrequencyResponse
from rigwatch.physics.transfer.levenberg import (
    Descent,
    descend,
    least_squares_coefficients,
)
from rigwatch.physics.transfer.transfer_function import TransferFunction, reflected
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

Complex = NDArray[np.complex128]
START_ROUNDS = 30
DESCENT = Descent(steps=200, more=4.0, less=5.0, worth=1e-12)


def fit_transfer_function(
    measured: FrequencyResponse, poles: int = 4, zeros: int = 0, delay: int = 1
) -> TransferFunction:
    """The stable function b(q⁻¹)·q⁻ᵈ/A(q⁻¹) that fits a measured response best.

    Args:
        measured: lines to fit, already limited to their band.
        poles: order of A.
        zeros: order of b; the numerator has zeros + 1 coefficients.
        delay: d [samples].

    Raises:
        ModelError: the response has too few lines or the fit fails.
    """
    if measured.frequency.size < (poles + zeros + 1):
        raise ModelError(
            f"transfer function: found {measured.frequency.size} lines, "
            f"expected more than {poles + zeros}"
        )
    problem = _Problem(measured, poles, zeros, delay)
    theta = problem.linear_start()
    theta = problem.descend(theta)
    return problem.function(theta)


class _Problem:
    """(5.19) for θ = (b0 … b_zeros, a1 … a_poles)."""

    def __init__(self, measured: FrequencyResponse, poles: int, zeros: int, delay: int) -> None:
        self.poles, self.delay = poles, delay
        self.zeros = zeros
        z = np.exp(-2j * np.pi * measured.frequency / measured.sample_rate)
        self.numerator = z[:, None] ** (delay + np.arange(zeros + 1))
        self.denominator = z[:, None] ** np.arange(1, poles + 1)
        self.g, self.w = measured.response, measured.weights()

    def function(self, theta: FloatArray) -> TransferFunction:
        b = np.concatenate([np.zeros(self.delay), theta[: self.zeros + 1]])
        return TransferFunction.of(b, np.concatenate([[1.0], theta[self.zeros + 1 :]]))

    def linear_start(self) -> FloatArray:
        """Levy, then Sanathanan and Koerner."""
        weight = self.w
        best, best_cost = np.zeros(0), np.inf
        for _ in range(START_ROUNDS):
            theta = self._levy(weight)
            stable = self._stable(theta)
            if (cost := self._cost(stable)) < best_cost:
                best, best_cost = stable, cost
            weight = self.w / np.abs(1.0 + self.denominator @ theta[self.zeros + 1 :])
        if not np.isfinite(best_cost):
            raise ModelError("transfer function: the linear start diverged (NaN or infinite)")
        return best

    def _levy(self, weight: FloatArray) -> FloatArray:
        rows = np.hstack([self.numerator, -self.g[:, None] * self.denominator]) * weight[:, None]
        target = np.asarray(self.g * weight, dtype=np.complex128)
        return least_squares_coefficients(np.asarray(rows, dtype=np.complex128), target)

    def _stable(self, theta: FloatArray) -> FloatArray:
        a = reflected(np.concatenate([[1.0], theta[self.zeros + 1 :]]))
        return np.concatenate([self._best_numerator(a[1:]), a[1:]])

    def _best_numerator(self, a: FloatArray) -> FloatArray:
        scale = self.w / (1.0 + self.denominator @ a)
        return least_squares_coefficients(
            self.numerator * scale[:, None], np.asarray(self.g * self.w, dtype=np.complex128)
        )

    def _errors(self, theta: FloatArray) -> Complex:
        model = self.numerator @ theta[: self.zeros + 1]
        return np.asarray(
            (self.g - model / (1.0 + self.denominator @ theta[self.zeros + 1 :])) * self.w
        )

    def _cost(self, theta: FloatArray) -> float:
        cost = float(np.sum(np.abs(self._errors(theta)) ** 2))
        return cost if np.isfinite(cost) else np.inf

    def _gradient(self, theta: FloatArray) -> Complex:
        a = 1.0 + self.denominator @ theta[self.zeros + 1 :]
        model = self.numerator @ theta[: self.zeros + 1] / a
        columns = [self.numerator / a[:, None], -self.denominator * (model / a)[:, None]]
        return np.asarray(np.hstack(columns) * self.w[:, None])

    def descend(self, theta: FloatArray) -> FloatArray:
        return descend(
            theta,
            DESCENT,
            errors=self._errors,
            gradient=self._gradient,
            cost=self._cost,
            admissible=self._stable,
        )
