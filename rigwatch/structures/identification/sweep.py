"""The linear sweep of quasilinearization, and the rates of a model along a record.

Along a nominal trajectory X̄ (states at the samples, straight lines between them) and parameters p̄

    dP/dt = f(X̄, p̄) + J·(P − X̄),   dH/dt = J·H + ∂f/∂p,   J = ∂f/∂x at (X̄, p̄)      (4.13), (4.14)

with an explicit Runge-Kutta method, one step per sample. Parameters are relative to p̄, so X = P +
H·δ with the unknown change δ. The columns of H are the free parameters, then the unknown initial
states. J comes from the model's machine code: it is exact, and its zeros cost nothing.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import System
from rigwatch.structures.identification import sweep_kernel as kernel
from rigwatch.structures.identification.integrators import CLASSICAL, Integrator
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class Swept:
    """The result of a sweep, for m unknowns.

    Attributes:
        outputs: of P, shape (samples, outputs).
        slopes: derivatives by the unknowns, shape (samples, outputs, m).
        states: P, shape (samples, n).
        state_slopes: H, shape (samples, n, m).
    """

    outputs: FloatArray
    slopes: FloatArray
    states: FloatArray
    state_slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Sweeper:
    """A compiled system with its sweeps and steps."""

    compiled: CompiledSystem

    def sweep(  # noqa: PLR0917 -- they stand in the order of the equations'
        self,
        inputs: FloatArray,
        dt: float,
        first: int,
        nominal: FloatArray,
        parameters: FloatArray,
        initial: FloatArray,
        unknown: IntArray,
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
        rates, read = self.compiled.kernel.with_sensitivities(width)
        kernel.sweep(
            rates, read, np.ascontiguousarray(inputs), dt, first, self.compiled.hold, method.a,
            method.b, method.c, method.apart, np.ascontiguousarray(nominal), parameters, start,
            outputs, slopes, path,
        )  # fmt: skip
        return Swept(outputs, slopes, path[..., -1], path[..., :-1])

    def rates(
        self, inputs: FloatArray, dt: float, first: int, nominal: FloatArray, parameters: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Rates along `nominal` (samples, n), and slopes (samples, n, free parameters + n)."""
        rates = self.compiled.kernel.jacobians().rates
        return self._along(rates, nominal.shape[1], inputs, dt, first, nominal, parameters)

    def observe(
        self, inputs: FloatArray, dt: float, row: int, x: FloatArray, parameters: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Outputs at a sample, and their slopes by free parameters and states."""
        read, wanted = self.compiled.kernel.jacobians().reads, len(self.compiled.system.outputs)
        here = slice(row, row + 1)
        y, dy = self._along(read, wanted, inputs[here], dt, row, x[None], parameters)
        return y[0], dy[0]

    def _along(  # noqa: PLR0917 -- as above
        self,
        equations: int,
        count: int,
        inputs: FloatArray,
        dt: float,
        first: int,
        nominal: FloatArray,
        parameters: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        columns = self.compiled.columns
        value = np.empty((len(nominal), count))
        slopes = np.empty((len(nominal), count, columns + len(self.compiled.system.probes)))
        kernel.slopes_along(
            equations, np.ascontiguousarray(inputs), dt, first, np.ascontiguousarray(nominal),
            parameters, value, slopes,
        )  # fmt: skip
        return value, slopes[..., :columns]

    def forward(  # noqa: PLR0917 -- as above
        self,
        inputs: FloatArray,
        dt: float,
        row: int,
        substeps: int,
        x: FloatArray,
        parameters: FloatArray,
    ) -> FloatArray:
        """Advance the states x by a sample, in place; slopes by free parameters and old states."""
        slopes = np.empty((len(x), self.compiled.columns))
        step = self.compiled.kernel.step(self.compiled.columns)
        kernel.forward(step, inputs, dt, row, substeps, self.compiled.hold, x, parameters, slopes)
        return slopes


def sweeper(system: System) -> Sweeper:
    """The sweeps of `system`.

    Raises:
        ModelError: the system has no states.
    """
    if not system.states:
        raise ModelError(f"{system.model.name}: found no states, expected equations of motion")
    return Sweeper(compile_system(system))
