"""The loops of quasilinearization and of a filter's steps, around a system's machine code.

Sensitivities are stored as [H | P]: a column per unknown, the solution last. The equations come as
addresses of functions, as in `engine.compile.integrator`.
"""

import numpy as np

from rigwatch.physics.engine.compile import across, call, input_rows, place
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part


@kernel(error_model="numpy")
def _linear(  # noqa: PLR0917 -- a kernel
    rates: int, t: float, us: FloatArray, pp: int, xs: FloatArray, s: FloatArray, part: float,
    z: FloatArray, dz: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Add `part` of the linear rates about xs to `out`; s: [H | P]."""
    n, width = s.shape
    for i in range(n):
        z[i] = xs[i]
        for j in range(width):
            z[n + i * width + j] = s[i, j]
        z[n + i * width + width - 1] -= xs[i]
    call(rates, t, z.ctypes.data, us.ctypes.data, pp, dz.ctypes.data, dz.ctypes.data)
    for i in range(n):
        out[i, width - 1] += part * dz[i]
        for j in range(width):
            out[i, j] += part * dz[n + i * width + j]


@kernel(error_model="numpy")
def _add(dt: float, shares: FloatArray, ks: FloatArray, out: FloatArray) -> None:
    """Add the weighted rates of the stages so far."""
    for stage in range(shares.size):
        weight = dt * shares[stage]
        if weight != 0.0:
            for i in range(out.shape[0]):
                for j in range(out.shape[1]):
                    out[i, j] += weight * ks[stage, i, j]


@part(error_model="numpy")
def _between(nominal: FloatArray, k: int, share: float, xs: FloatArray) -> None:
    """The nominal trajectory, interpolated linearly from sample k to the next."""
    for i in range(xs.size):
        xs[i] = nominal[k, i]
        if share > 0.0:
            xs[i] += share * (nominal[k + 1, i] - nominal[k, i])


@kernel(allocates=True, error_model="numpy")
def sweep(  # noqa: C901, PLR0917 -- a kernel
    rates: int, read: int, u: FloatArray, dt: float, first: int, hold: FloatArray, a: FloatArray,
    b: FloatArray, c: FloatArray, apart: bool, nominal: FloatArray, p: FloatArray, s: FloatArray,
    y: FloatArray, dy: FloatArray, path: FloatArray,
) -> None:  # fmt: skip
    """Fill outputs y of P, their slopes dy by H, and path = [H | P] at the samples, from s."""
    count, n = nominal.shape
    width, last = s.shape[1], s.shape[1] - 1
    xs, us, ss = np.empty(n), input_rows(u, 1)[0], np.empty((n, width))
    z, dz = np.empty(n * (1 + width)), np.empty(n * (1 + width))
    ks, wide, pp = np.zeros((b.size, n, width)), np.empty((y.shape[1], width)), p.ctypes.data
    for k in range(count):
        _between(nominal, k, 0.0, xs)
        place(u, k, 0, 0.0, 0.0, hold, 1, dt, us)
        for i in range(n):
            z[i] = xs[i]
            for j in range(width):
                path[k, i, j] = s[i, j]
                z[n + i * width + j] = s[i, j]
            z[n + i * width + last] -= xs[i]
        call(
            read, (first + k) * dt, z.ctypes.data, us.ctypes.data, pp, y[k].ctypes.data,
            wide.ctypes.data,
        )  # fmt: skip
        for o in range(y.shape[1]):
            y[k, o] += wide[o, last]
            for j in range(last):
                dy[k, o, j] = wide[o, j]
        if k + 1 == count:
            break
        for stage in range(b.size):
            ss[:] = s
            _add(dt, a[stage, :stage], ks, ss)
            share, t = c[stage], (first + k + c[stage]) * dt
            ks[stage] = 0.0
            place(u, k, 0, share, share, hold, 1, dt, us)
            if apart:
                if share < 1.0:
                    _between(nominal, k, 0.0, xs)
                    _linear(rates, t, us, pp, xs, ss, 1.0 - share, z, dz, ks[stage])
                if share > 0.0:
                    _between(nominal, k, 1.0, xs)
                    _linear(rates, t, us, pp, xs, ss, share, z, dz, ks[stage])
            else:
                _between(nominal, k, share, xs)
                _linear(rates, t, us, pp, xs, ss, 1.0, z, dz, ks[stage])
        _add(dt, b, ks, s)


@kernel(allocates=True, error_model="numpy")
def slopes_along(  # noqa: PLR0917 -- a kernel
    values: int, u: FloatArray, dt: float, first: int, nominal: FloatArray, p: FloatArray,
    value: FloatArray, slopes: FloatArray,
) -> None:  # fmt: skip
    """Values of equations and their derivatives, at every sample of `nominal`."""
    us = input_rows(u, 1)[0]
    us[u.shape[1]] = 0.0
    for k in range(nominal.shape[0]):
        us[: u.shape[1]] = u[k]
        call(
            values, (first + k) * dt, nominal[k].ctypes.data, us.ctypes.data, p.ctypes.data,
            value[k].ctypes.data, slopes[k].ctypes.data,
        )  # fmt: skip


@kernel(allocates=True, error_model="numpy")
def forward(  # noqa: PLR0917 -- a kernel
    step: int, u: FloatArray, dt: float, row: int, substeps: int, hold: FloatArray,
    x: FloatArray, p: FloatArray, s: FloatArray,
) -> None:  # fmt: skip
    """Advance x by a sample; s becomes its derivative by free parameters and the old state."""
    n, m = s.shape
    z, us, times = np.zeros(n * (1 + m)), input_rows(u, 3), np.empty(4)
    for i in range(n):
        z[i] = x[i]
        z[n + i * m + m - n + i] = 1.0
    none, room = np.empty(0, np.int64), np.empty(n)
    across(
        step, 0, u, row, 0, substeps, hold, none, 1, row * dt, dt, p.ctypes.data, z, us, times,
        room, room,
    )  # fmt: skip
    for i in range(n):
        x[i] = z[i]
        for j in range(m):
            s[i, j] = z[n + i * m + j]
