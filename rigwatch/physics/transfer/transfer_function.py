"""A discrete transfer function and its simulation, sample by sample.

    y(t) = B(q⁻¹)/A(q⁻¹)·u(t),   A = 1 + a1·q⁻¹ + … + an·q⁻ⁿ

The filter keeps its state between calls, in transposed direct form II, so dividing a signal into
blocks does not change a bit of the result.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel, part


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """B(q⁻¹)/A(q⁻¹) with monic A.

    Args:
        b: numerator, ascending powers of q⁻¹, shape (nb,).
        a: denominator, ascending powers of q⁻¹, shape (na,), a[0] = 1.

    Raises:
        ModelError: a coefficient is not finite or a[0] is not 1.
    """

    b: FloatArray
    a: FloatArray

    def __post_init__(self) -> None:
        if not (np.all(np.isfinite(self.b)) and np.all(np.isfinite(self.a))):
            raise ModelError("transfer function: found a coefficient that is not finite")
        if self.a.size == 0 or self.b.size == 0 or self.a[0] != 1.0:
            raise ModelError("transfer function: found no leading 1 in the denominator")

    @classmethod
    def of(cls, b: ArrayLike, a: ArrayLike) -> "TransferFunction":
        """From any sequences of numbers; the denominator is normalised to be monic."""
        denominator = np.atleast_1d(np.asarray(a, dtype=np.float64))
        numerator = np.atleast_1d(np.asarray(b, dtype=np.float64))
        return cls(numerator / denominator[0], denominator / denominator[0])

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles in z, shape (na - 1,)."""
        return np.roots(self.a).astype(np.complex128)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(np.abs(self.poles) < 1.0))

    def response(self, frequency: FloatArray, sample_rate: float) -> NDArray[np.complex128]:
        """Frequency response at `frequency` [Hz], shape like `frequency`."""
        z = np.exp(-2j * np.pi * np.asarray(frequency) / sample_rate)
        numerator = np.polynomial.polynomial.polyval(z, self.b)
        return np.asarray(numerator / np.polynomial.polynomial.polyval(z, self.a))

    def simulate(self, u: ArrayLike) -> FloatArray:
        """Response to `u` from rest, shape (n,)."""
        return Filter(self).update(np.asarray(u, dtype=np.float64))

    def second_difference(self, sample_rate: float) -> "TransferFunction":
        """The function times (1 - q⁻¹)²·fs²: position to acceleration, delayed by one sample."""
        return TransferFunction(np.convolve(self.b, [1.0, -2.0, 1.0]) * sample_rate**2, self.a)

    def padded(self) -> tuple[FloatArray, FloatArray]:
        """(b, a) zero-padded to equal length for the kernels."""
        order = max(self.b.size, self.a.size)
        b, a = np.zeros(order), np.zeros(order)
        b[: self.b.size], a[: self.a.size] = self.b, self.a
        return b, a


class Filter:
    """A running transfer function for blocks of any size."""

    def __init__(self, function: TransferFunction) -> None:
        self._b, self._a = function.padded()
        self.state = np.zeros(max(self._b.size - 1, 1))

    def reset(self) -> None:
        """Back to rest."""
        self.state[:] = 0.0

    def update(self, u: FloatArray) -> FloatArray:
        """The next len(u) outputs, shape (n,)."""
        y = np.empty(u.size)
        filter_block(self._b, self._a, self.state, u, y)
        return y


@part(inline="always")
def filter_sample(b: FloatArray, a: FloatArray, state: FloatArray, u: float) -> float:
    """One step of the filter; `b` and `a` of one length, `state` one shorter (at least one).

    The orders 3 and 4, which a rig's filters have, are written out: the compiler makes vectors of a
    loop over so few, which takes longer than the loop, as does a call.
    """
    last = b.size - 1
    if last < 3 or last > 4:
        return _any_order(b, a, state, u)
    y = b[0] * u + state[0]
    state[0] = b[1] * u - a[1] * y + state[1]
    state[1] = b[2] * u - a[2] * y + state[2]
    if last == 3:
        state[2] = b[3] * u - a[3] * y
    else:
        state[2] = b[3] * u - a[3] * y + state[3]
        state[3] = b[4] * u - a[4] * y
    return y


@part()
def _any_order(b: FloatArray, a: FloatArray, state: FloatArray, u: float) -> float:
    last = b.size - 1
    y = b[0] * u + (state[0] if last > 0 else 0.0)
    for i in range(last - 1):
        state[i] = b[i + 1] * u - a[i + 1] * y + state[i + 1]
    if last > 0:
        state[last - 1] = b[last] * u - a[last] * y
    return y


@kernel()
def filter_block(
    b: FloatArray, a: FloatArray, state: FloatArray, u: FloatArray, y: FloatArray
) -> None:
    """`filter_sample` over a block."""
    for k in range(u.size):
        y[k] = filter_sample(b, a, state, u[k])


def reflected(a: FloatArray, margin: float = 1e-6) -> FloatArray:
    """Monic polynomial `a` with roots outside the unit circle reflected into it.

    Args:
        a: ascending powers of q⁻¹, a[0] = 1.
        margin: roots end at most at radius 1 - margin.
    """
    roots = np.roots(a)
    size = np.abs(roots)
    outside = size > 1.0
    roots[outside] = 1.0 / np.conj(roots[outside])
    size = np.abs(roots)
    far = size > 1.0 - margin
    roots[far] *= (1.0 - margin) / size[far]
    return np.real(np.poly(roots)).astype(np.float64)
