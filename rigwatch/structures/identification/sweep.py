"""Kernels beside a model's own: the linear sweep of quasilinearization, and rates along a record.

Along a nominal trajectory X̄ (states at the samples, straight lines between them) and parameters p̄

    dP/dt = f(X̄, p̄) + J·(P − X̄),   dH/dt = J·H + ∂f/∂p,   J = ∂f/∂x at (X̄, p̄)      (4.13), (4.14)

with an explicit Runge-Kutta method, one step a sample. The parameters count from p̄, so X = P +
H·δ with the change δ to be found. The columns of H are the free parameters, then the unknown
initial states. `rates` is the model's own kernel, so that J is exact and its zeros cost nothing.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from rigwatch.physics.engine.compile import (
    CompiledSystem,
    compile_system,
    load_source,
    numba_module,
)
from rigwatch.physics.engine.equations import System
from rigwatch.structures.identification.integrators import CLASSICAL, Integrator
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

_SOURCE = '''"""Sweeps along a record, for the kernel {name}."""

import numpy as np
from numba import njit

from {name} import advance, rates, read


@njit(cache=True, error_model="numpy")
def place(u, nominal, k, share, hold, xs, us):
    last = k + 1 == nominal.shape[0]
    for j in range(us.size):
        ahead = 0.0 if last else u[k + 1, j] - u[k, j]
        us[j] = u[k, j] + hold * share * ahead
    for i in range(xs.size):
        ahead = 0.0 if last else nominal[k + 1, i] - nominal[k, i]
        xs[i] = nominal[k, i] + share * ahead


@njit(cache=True, error_model="numpy")
def linear(t, xs, us, p, s, part, f, ds, out):
    """Adds `part` of the linear rates about xs to `out`; s: [H | P], not changed in the end."""
    n, width = s.shape
    for i in range(n):
        s[i, width - 1] -= xs[i]
    rates(t, xs, us, p, s, f, ds)
    for i in range(n):
        s[i, width - 1] += xs[i]
        out[i, width - 1] += part * f[i]
        for j in range(width):
            out[i, j] += part * ds[i, j]


@njit(cache=True, error_model="numpy")
def add(dt, shares, ks, out):
    for stage in range(shares.size):
        weight = dt * shares[stage]
        if weight != 0.0:
            for i in range(out.shape[0]):
                for j in range(out.shape[1]):
                    out[i, j] += weight * ks[stage, i, j]


@njit(cache=True, error_model="numpy")
def sweep(u, dt, first, hold, a, b, c, apart, nominal, p, s, y, dy, path):
    """s: [H | P] at the start; y, dy: outputs of P and H; path: [H | P] at the samples."""
    count, n = nominal.shape
    width, last = s.shape[1], s.shape[1] - 1
    xs, us, f = np.empty(n), np.empty(u.shape[1]), np.empty(n)
    ss, ds = np.empty((n, width)), np.zeros((n, width))
    ks = np.zeros((b.size, n, width))
    wide = np.empty((y.shape[1], width))
    for k in range(count):
        place(u, nominal, k, 0.0, hold, xs, us)
        path[k] = s
        for i in range(n):
            for j in range(width):
                ss[i, j] = s[i, j]
            ss[i, last] -= xs[i]
        read((first + k) * dt, xs, us, p, ss, y[k], wide)
        for o in range(y.shape[1]):
            y[k, o] += wide[o, last]
            for j in range(last):
                dy[k, o, j] = wide[o, j]
        if k + 1 == count:
            break
        for stage in range(b.size):
            ss[:] = s
            add(dt, a[stage, :stage], ks, ss)
            share, t = c[stage], (first + k + c[stage]) * dt
            ks[stage] = 0.0
            place(u, nominal, k, share, hold, xs, us)
            if apart:
                if share < 1.0:
                    xs[:] = nominal[k]
                    linear(t, xs, us, p, ss, 1.0 - share, f, ds, ks[stage])
                if share > 0.0:
                    xs[:] = nominal[k + 1]
                    linear(t, xs, us, p, ss, share, f, ds, ks[stage])
            else:
                linear(t, xs, us, p, ss, 1.0, f, ds, ks[stage])
        add(dt, b, ks, s)


@njit(cache=True, error_model="numpy")
def along(u, dt, first, nominal, p, rate, slopes):
    """Rates and their derivatives by free parameters and states, at every sample of `nominal`."""
    n = nominal.shape[1]
    unit = np.zeros((n, slopes.shape[2]))
    for i in range(n):
        unit[i, slopes.shape[2] - n + i] = 1.0
    for k in range(nominal.shape[0]):
        rates((first + k) * dt, nominal[k], u[k], p, unit, rate[k], slopes[k])


@njit(cache=True, error_model="numpy")
def observe(u, dt, row, x, p, y, dy):
    """Outputs at a sample, and their derivatives by free parameters and states."""
    n = x.size
    unit = np.zeros((n, dy.shape[1]))
    for i in range(n):
        unit[i, dy.shape[1] - n + i] = 1.0
    read(row * dt, x, u[row], p, unit, y, dy)


@njit(cache=True, error_model="numpy")
def forward(u, dt, row, substeps, hold, x, p, s):
    """Moves x by a sample; s becomes its derivative by free parameters and the state before."""
    n, m = s.shape
    xs, dx, acc, us = np.empty(n), np.zeros(n), np.empty(n), np.empty(u.shape[1])
    ss, ds, sacc = np.empty((n, m)), np.zeros((n, m)), np.empty((n, m))
    for i in range(n):
        for j in range(m):
            s[i, j] = 1.0 if j == m - n + i else 0.0
    for step in range(substeps):
        advance(u, row, step, substeps, hold, dt, p, x, xs, dx, acc, s, ss, ds, sacc, us)
'''


@dataclass(frozen=True, eq=False)
class Swept:
    """Result of a sweep, for m unknowns.

    Attributes:
        outputs: of P, shape (samples, outputs).
        slopes: by the unknowns, shape (samples, outputs, m).
        states: P, shape (samples, n).
        state_slopes: H, shape (samples, n, m).
    """

    outputs: FloatArray
    slopes: FloatArray
    states: FloatArray
    state_slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Sweeper:
    """A compiled system with its sweeps."""

    compiled: CompiledSystem
    kernel: ModuleType

    @property
    def hold(self) -> float:
        """1 where inputs run straight between samples, else 0."""
        return 1.0 if self.compiled.system.model.hold != "zero" else 0.0

    def sweep(  # noqa: PLR0917 -- they stand in the order of the equations'
        self,
        inputs: FloatArray,
        dt: float,
        first: int,
        nominal: FloatArray,
        parameters: FloatArray,
        initial: FloatArray,
        unknown: NDArray[np.int64],
        method: Integrator = CLASSICAL,
    ) -> Swept:
        """One linear sweep along `nominal`.

        Args:
            inputs: from sample `first` on, shape (samples, inputs).
            dt: time between samples [s].
            first: number of the first sample, for the time.
            nominal: shape (samples, n).
            parameters: all of them, shape (n_p,).
            initial: shape (n,).
            unknown: which initial states are unknown, shape (k,).
            method: of integration.
        """
        samples, n = nominal.shape
        free, wanted = len(self.compiled.system.free), len(self.compiled.system.outputs)
        width = free + len(unknown) + 1
        start = np.zeros((n, width))
        start[unknown, free + np.arange(len(unknown))] = 1.0
        start[:, -1] = initial
        outputs = np.empty((samples, wanted))
        slopes = np.empty((samples, wanted, width - 1))
        path = np.empty((samples, n, width))
        self.kernel.sweep(
            np.ascontiguousarray(inputs), dt, first, self.hold, method.a, method.b, method.c,
            method.apart, np.ascontiguousarray(nominal), parameters, start, outputs, slopes, path,
        )  # fmt: skip
        return Swept(outputs, slopes, path[..., -1], path[..., :-1])

    def rates(
        self,
        inputs: FloatArray,
        dt: float,
        first: int,
        nominal: FloatArray,
        parameters: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Rates along `nominal` (samples, n), and slopes (samples, n, free parameters + n)."""
        rate = np.empty(nominal.shape)
        slopes = np.zeros((*nominal.shape, self.compiled.columns))
        self.kernel.along(
            np.ascontiguousarray(inputs), dt, first, np.ascontiguousarray(nominal), parameters,
            rate, slopes,
        )  # fmt: skip
        return rate, slopes


def sweeper(system: System) -> Sweeper:
    """The kernels of `system`, from the cache where they are known.

    Raises:
        ModelError: the system has no states.
    """
    compiled = compile_system(system)
    if not system.states:
        raise ModelError(f"{system.model.name}: found no states, expected equations of motion")
    equations = numba_module(compiled.system)
    return Sweeper(compiled, load_source(_SOURCE.replace("{name}", equations.__name__)))
