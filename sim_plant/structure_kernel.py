"""Moves masses on springs by an extrapolated midpoint rule (Gragg, Bulirsch and Stoer).

    m_i·a_i = f_i(t) − Σ_s ±F_s(d_s) − Σ_c ±R_c(ḋ_c),   base motion: a_i −= a_0(t)

The modified midpoint rule over a step H is run with 2, 4, 6 and 8 parts; extrapolated to endless
many, the result is of eighth order. Each element pulls on its two ends in turn; no matrix is built.
"""

# numba's functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel, part

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LINEAR, HARDENING, SOFTENING, GAP = range(4)
GROUND = -1
"""Node number of the ground, as an end; of the base, as a load."""


class Elements(NamedTuple):
    """Springs or dampers.

    Attributes:
        first, second: nodes at their ends, the second may be GROUND, shape (s,).
        law: of the first coefficient, shape (s,).
        numbers: first, quadratic and cubic coefficient, length of the law; shape (s, 4).
    """

    first: Ints
    second: Ints
    law: Ints
    numbers: Floats


class Loads(NamedTuple):
    """Everything that pushes; a node of GROUND is an acceleration of the base.

    Attributes:
        step_node, step: node; size and time of each step, shape (a,) and (a, 2).
        sine_node, sine: node; amplitude, omega and phase of each sine, shape (b,) and (b, 3).
        record_node: node of each recorded column, shape (c,).
        record: straight lines between the values, shape (n, c).
        record_step: time between the values [s].
    """

    step_node: Ints
    step: Floats
    sine_node: Ints
    sine: Floats
    record_node: Ints
    record: Floats
    record_step: float


@part()
def pull(law: int, k: float, length: float, d: float) -> float:
    """Force of the law itself at elongation d [N]."""
    if law == HARDENING:
        return k * length * math.sinh(d / length)
    if law == SOFTENING:
        return k * length * math.tanh(d / length)
    if law == GAP:
        return k * (d - length if d > length else (d + length if d < -length else 0.0))
    return k * d


@kernel()
def push(loads: Loads, t: float, middle: float, force: Floats) -> float:
    """Adds the loads at t to `force`; returns the base's acceleration.

    `middle` lies inside the integration step, so that a step load at its very end is not felt yet.
    """
    base = 0.0
    for i in range(loads.step_node.size):
        size = loads.step[i, 0] if middle >= loads.step[i, 1] else 0.0
        if loads.step_node[i] == GROUND:
            base += size
        else:
            force[loads.step_node[i]] += size
    for i in range(loads.sine_node.size):
        value = loads.sine[i, 0] * math.sin(loads.sine[i, 1] * t + loads.sine[i, 2])
        if loads.sine_node[i] == GROUND:
            base += value
        else:
            force[loads.sine_node[i]] += value
    for i in range(loads.record_node.size):
        place = min(max(t / loads.record_step, 0.0), loads.record.shape[0] - 1.0)
        row = min(int(place), loads.record.shape[0] - 2)
        share = place - row
        value = (1.0 - share) * loads.record[row, i] + share * loads.record[row + 1, i]
        if loads.record_node[i] == GROUND:
            base += value
        else:
            force[loads.record_node[i]] += value
    return base


@part()
def accelerate(  # noqa: PLR0917 -- a kernel
    t: float,
    middle: float,
    x: Floats,
    v: Floats,
    mass: Floats,
    springs: Elements,
    dampers: Elements,
    loads: Loads,
    a: Floats,
) -> None:
    """Accelerations of all nodes into `a`."""
    a[:] = 0.0
    base = push(loads, t, middle, a)
    for s in range(springs.first.size):
        i, j = springs.first[s], springs.second[s]
        d = x[i] - (0.0 if j == GROUND else x[j])
        n = springs.numbers[s]
        f = pull(springs.law[s], n[0], n[3], d) + d * d * (n[1] + n[2] * d)
        a[i] -= f
        if j != GROUND:
            a[j] += f
    for s in range(dampers.first.size):
        i, j = dampers.first[s], dampers.second[s]
        d = v[i] - (0.0 if j == GROUND else v[j])
        n = dampers.numbers[s]
        f = d * (n[0] + n[1] * abs(d) + n[2] * d * d)
        a[i] -= f
        if j != GROUND:
            a[j] += f
    for i in range(a.size):
        a[i] = a[i] / mass[i] - base


@kernel(allocates=True)
def integrate(  # noqa: C901, PLR0912, PLR0917 -- a kernel
    grid: Floats,
    parts: int,
    x: Floats,
    v: Floats,
    mass: Floats,
    springs: Elements,
    dampers: Elements,
    loads: Loads,
    path: Floats,
) -> None:
    """Runs along `grid`, each interval in `parts` extrapolated steps; x and v are moved.

    `path` receives x, v and a at every point of the grid, shape (points, 3, n).
    """
    n = x.size
    a, rows = np.empty(n), np.empty((4, 2, n))
    x0, v0, x1, v1 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for point in range(grid.size):
        accelerate(grid[point], grid[point], x, v, mass, springs, dampers, loads, a)
        path[point, 0], path[point, 1], path[point, 2] = x, v, a
        if point + 1 == grid.size:
            break
        step = (grid[point + 1] - grid[point]) / parts
        for nth in range(parts):
            t = grid[point] + nth * step
            middle = t + 0.5 * step
            for level in range(4):
                count = 2 * (level + 1)
                h = step / count
                accelerate(t, middle, x, v, mass, springs, dampers, loads, a)
                for i in range(n):
                    x0[i], v0[i] = x[i], v[i]
                    x1[i], v1[i] = x[i] + h * v[i], v[i] + h * a[i]
                for k in range(1, count + 1):
                    accelerate(t + k * h, middle, x1, v1, mass, springs, dampers, loads, a)
                    if k == count:
                        for i in range(n):
                            rows[level, 0, i] = 0.5 * (x0[i] + x1[i] + h * v1[i])
                            rows[level, 1, i] = 0.5 * (v0[i] + v1[i] + h * a[i])
                    else:
                        for i in range(n):
                            x2, v2 = x0[i] + 2.0 * h * v1[i], v0[i] + 2.0 * h * a[i]
                            x0[i], v0[i], x1[i], v1[i] = x1[i], v1[i], x2, v2
            for order in range(1, 4):
                for level in range(3, order - 1, -1):
                    ratio = ((level + 1) / (level + 1 - order)) ** 2 - 1.0
                    for i in range(n):
                        for q in range(2):
                            gain = rows[level, q, i] - rows[level - 1, q, i]
                            rows[level, q, i] += gain / ratio
            for i in range(n):
                x[i], v[i] = rows[3, 0, i], rows[3, 1, i]
