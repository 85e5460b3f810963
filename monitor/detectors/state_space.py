"""A transfer function as a state-space model whose states are past outputs and inputs.

    x(k) = [ y(k), …, y(k-n+1), u(k-1), …, u(k-m+1) ]
    x(k+1) = A·x(k) + B·u(k),   y(k) = x1(k)

    n   order of the denominator        m   last power of q⁻¹ in the numerator

Every state has a meaning and a unit, so a second measurement is easy: the acceleration one sample
ago is the second difference fs²·(y(k) - 2·y(k-1) + y(k-2)).
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class StateSpace:
    """Matrices of the model.

    Attributes:
        a: shape (n + m - 1, n + m - 1).
        b: shape (n + m - 1,).
        outputs: n, the states that are past outputs.
    """

    a: FloatArray
    b: FloatArray
    outputs: int

    def position_row(self) -> FloatArray:
        """Row of H for y(k)."""
        row = np.zeros(self.b.size)
        row[0] = 1.0
        return row

    def acceleration_row(self, sample_rate: float) -> FloatArray:
        """Row of H for the acceleration one sample ago.

        Raises:
            ModelError: the model is of an order below 3.
        """
        if self.outputs < 3:
            raise ModelError(f"acceleration: found a model of order {self.outputs}, expected 3")
        row = np.zeros(self.b.size)
        row[:3] = sample_rate**2 * np.array([1.0, -2.0, 1.0])
        return row


def state_space(function: TransferFunction) -> StateSpace:
    """`function` in the form above.

    Raises:
        ModelError: the output follows the input without delay, or the model has no dynamics.
    """
    b = np.trim_zeros(function.b, "b")
    n, m = function.a.size - 1, b.size - 1
    if n < 1 or m < 1 or b[0] != 0.0:
        raise ModelError("state space: found a model without delay, expected at least one sample")
    size = n + m - 1
    a = np.zeros((size, size))
    a[0, :n], a[0, n:] = -function.a[1:], b[2:]
    a[1:n, : n - 1] = np.eye(n - 1)
    a[n + 1 :, n : size - 1] = np.eye(max(m - 2, 0))
    column = np.zeros(size)
    column[0] = b[1]
    if m > 1:
        column[n] = 1.0
    return StateSpace(a, column, n)
