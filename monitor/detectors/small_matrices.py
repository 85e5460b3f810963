"""Products and inverses of matrices of a few rows, in plain loops.

A linear algebra library sums in an order that depends on the processor; these sum from left to
right, so that a replay is identical to the bit everywhere, and for five rows they are faster. Sums
are loops too: an expression of whole arrays takes the compiler seconds.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

SMALLEST_PIVOT = 1e-13
"""A pivot below this share of the unit diagonal means a singular matrix [1]."""


@kernel(allocates=True)
def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """a·b, shape (n, m)."""
    out = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            for k in range(a.shape[1]):
                out[i, j] += a[i, k] * b[k, j]
    return out


@part(allocates=True)
def product_transposed(a: FloatArray, b: FloatArray) -> FloatArray:
    """a·bᵀ, shape (n, m)."""
    out = np.zeros((a.shape[0], b.shape[0]))
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            for k in range(a.shape[1]):
                out[i, j] += a[i, k] * b[j, k]
    return out


@part(allocates=True)
def transposed_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """aᵀ·b, shape (n, m)."""
    out = np.zeros((a.shape[1], b.shape[1]))
    for i in range(a.shape[1]):
        for j in range(b.shape[1]):
            for k in range(a.shape[0]):
                out[i, j] += a[k, i] * b[k, j]
    return out


@kernel(allocates=True)
def times(a: FloatArray, x: FloatArray) -> FloatArray:
    """a·x, shape (n,)."""
    out = np.zeros(a.shape[0])
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            out[i] += a[i, k] * x[k]
    return out


@part()
def put_sum(out: FloatArray, a: FloatArray, b: FloatArray) -> None:
    """out = a + b, of matrices."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j] + b[i, j]


@part()
def put_identity(out: FloatArray, scale: float) -> None:
    """out = scale·I."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = scale if i == j else 0.0


@kernel(allocates=True)
def inverse(matrix: FloatArray, out: FloatArray) -> bool:
    """Inverse of a symmetric positive definite matrix into `out`; False if it is singular.

    The matrix is scaled to a unit diagonal first, so that states in metres and in metres per square
    second are comparable. It raises nothing: a filter must be able to reset and continue.
    """
    n = matrix.shape[0]
    scale = np.empty(n)
    for i in range(n):
        if not matrix[i, i] > 0.0:
            return False
        scale[i] = 1.0 / np.sqrt(matrix[i, i])
    lower = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j] * scale[i] * scale[j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i != j:
                lower[i, j] = total / lower[j, j]
            elif total > SMALLEST_PIVOT:
                lower[i, i] = np.sqrt(total)
            else:
                return False
    _invert_factor(lower, scale, out)
    return True


@part(allocates=True)
def _invert_factor(lower: FloatArray, scale: FloatArray, out: FloatArray) -> None:
    """D·(L·Lᵀ)⁻¹·D from the factor L and the scale D."""
    n = lower.shape[0]
    half = np.zeros((n, n))
    for column in range(n):
        for i in range(column, n):
            total = 1.0 if i == column else 0.0
            for k in range(column, i):
                total -= lower[i, k] * half[k, column]
            half[i, column] = total / lower[i, i]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(max(i, j), n):
                total += half[k, i] * half[k, j]
            out[i, j] = total * scale[i] * scale[j]
