"""A system that can be simulated, with exact sensitivities, and linearised along a trajectory."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from rigwatch.physics.engine.compile.kernel import native_kernel
from rigwatch.physics.engine.compile.static_kernel import StaticKernel
from rigwatch.physics.engine.compile.step_size import (
    FINEST,
    constant_rates,
    fastest_of,
    steps_for,
)
from rigwatch.physics.engine.equations import System
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError


@dataclass(frozen=True, eq=False)
class Simulation:
    """Simulated outputs over windows of equal length.

    Attributes:
        outputs: shape (windows, samples, outputs), in the outputs' units.
        slopes: shape (windows, samples, outputs, free parameters + states): derivatives of the
            outputs by the free parameters, then by the window's initial states.
        last: states at each window's last sample, shape (windows, states).
        last_slopes: of these by the same, shape (windows, states, free parameters + states).
    """

    outputs: FloatArray
    slopes: FloatArray
    last: FloatArray
    last_slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A trajectory with its Jacobians at the nodes of the integration.

    With m free parameters, n states and q probes, the last axis of the slopes is (m, n, q).

    Attributes:
        spacing: time from each node to the next, shape (windows, nodes) [s].
        substeps: nodes per sample.
        states: shape (windows, nodes, n).
        rate_slopes: shape (windows, nodes, n, m + n + q): ∂rates.
        read_slopes: at the samples, shape (windows, samples, outputs, m + n + q): ∂outputs.
        outputs: at the samples, shape (windows, samples, outputs).
        update_slopes: at the samples, shape (windows, samples, n, m + n + q): derivatives of the
            states after an update by those before; shape (windows, 0, …) without sampled states.
        time: of the equations at the sample before each node, shape (windows, nodes) [s].
    """

    spacing: FloatArray
    substeps: int
    states: FloatArray
    rate_slopes: FloatArray
    read_slopes: FloatArray
    outputs: FloatArray
    update_slopes: FloatArray
    time: FloatArray

    def at_samples(self) -> "Linearisation":
        """The nodes at the samples alone, for what nothing fast passes on to the outputs."""
        every = slice(None, None, self.substeps)
        return replace(
            self, substeps=1, spacing=self.spacing[:, every] * self.substeps,
            states=self.states[:, every], rate_slopes=self.rate_slopes[:, every],
            time=self.time[:, every],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system that can be simulated."""

    system: System
    kernel: Any
    _fastest: dict[bytes, float] = field(default_factory=dict, init=False, repr=False)
    """The fastest rate at the last parameters: most simulations repeat those of the one before."""

    @property
    def parameters(self) -> FloatArray:
        """Values of all parameters in the model, shape (n_p,)."""
        return np.array([p.value for p in self.system.parameters.values()])

    def simulate(
        self,
        inputs: FloatArray,
        dt: float | FloatArray,
        starts: IntArray,
        length: int,
        *,
        initial: FloatArray,
        parameters: FloatArray,
        substeps: int = 4,
        finest: int = FINEST,
        rows: int = 1,
        begins: IntArray | None = None,
        time: FloatArray | None = None,
    ) -> Simulation:
        """Simulate windows of the inputs, each from its own initial state.

        Args:
            inputs: shape (samples, inputs).
            dt: time from each sample of the inputs to the next, shape (samples,), or of all [s].
            starts: first sample of each window, shape (windows,).
            length: samples in each window.
            initial: shape (windows, states).
            parameters: all of them, shape (n_p,).
            substeps: Runge-Kutta steps between samples.
            finest: most steps between samples for stiff effects or models, see `step_size`.
            rows: number of input rows per change of a held input, for inputs at finer nodes.
            begins: first sample of the recording that each belongs to, before which held inputs
                have not changed, shape (samples,); the first of all if None.
            time: of the equations at each sample, shape (samples,); from `begins` if None [s].

        Raises:
            ModelError: a window extends beyond the inputs, or a shape is wrong.
        """
        outputs = np.empty((len(starts), length, len(self.system.outputs)))
        slopes = np.empty((*outputs.shape, self.columns))
        needed = min(finest, steps_for(self.fastest(parameters), float(np.max(dt))))
        steps = max(substeps, needed)
        arguments = self._arguments(
            inputs, dt, begins, time, starts, length, initial, parameters, steps
        )
        n = len(self.system.states)
        last = np.empty((len(starts), n * (1 + self.columns)))
        self.kernel.simulate(*arguments, outputs, slopes, last, rows, finest)
        last_slopes = last[:, n:].reshape(len(starts), n, self.columns)
        return Simulation(outputs, slopes, last[:, :n], last_slopes)

    def fastest(self, parameters: FloatArray) -> float:
        """The largest of the model's constant rates; 0 without any [1/s].

        Args:
            parameters: all of them, shape (n_p,).
        """
        key = parameters.tobytes()
        found = self._fastest.get(key)
        if found is None:
            found = fastest_of(self.system, self._rates, parameters)
            self._fastest.clear()
            self._fastest[key] = found
        return found

    @cached_property
    def _rates(self) -> tuple[sympy.Expr, ...]:
        return constant_rates(self.system)

    @property
    def hold(self) -> FloatArray:
        """1 for a linear hold, minus its delay for a zero-order hold; shape (inputs,)."""
        model = self.system.model
        return np.array([
            1.0 if model.held(name) == "linear" else -own.late
            for name, own in model.inputs.items()
        ])  # fmt: skip

    @cached_property
    def _late(self) -> list[int]:
        """Columns of the inputs that arrive late by parameters, in the order of the kernel's."""
        names = list(self.system.model.inputs)
        return [names.index(own.name) for own in self.system.delayed.values()]

    @property
    def columns(self) -> int:
        """Number of free parameters and states, by which outputs are differentiated."""
        return len(self.system.free) + len(self.system.states)

    def linearise(
        self,
        inputs: FloatArray,
        dt: float | FloatArray,
        starts: IntArray,
        length: int,
        *,
        initial: FloatArray,
        parameters: FloatArray,
        substeps: int = 4,
        begins: IntArray | None = None,
        time: FloatArray | None = None,
    ) -> Linearisation:
        """The trajectory of `simulate` with its Jacobians; same arguments and errors."""
        arguments = self._arguments(
            inputs, dt, begins, time, starts, length, initial, parameters, substeps
        )
        n, wide = len(self.system.states), self.columns + len(self.system.probes)
        nodes = (len(starts), (length - 1) * substeps + 1)
        samples = (len(starts), length, len(self.system.outputs))
        states, rates = np.empty((*nodes, n)), np.zeros((*nodes, n, wide))
        outputs, reads = np.empty(samples), np.zeros((*samples, wide))
        count = length if self.system.updates else 0
        updates = np.zeros((len(starts), count, n, wide))
        self.kernel.linearise(*arguments, states, rates, outputs, reads, updates)
        rows = starts[:, None] + np.arange(nodes[1]) // substeps
        spacing, time = arguments[1][rows] / substeps, arguments[3][rows]
        return Linearisation(spacing, substeps, states, rates, reads, outputs, updates, time)

    def _arguments(  # noqa: PLR0917 -- they stand in the order of the kernel's
        self,
        inputs: FloatArray,
        dt: float | FloatArray,
        begins: IntArray | None,
        time: FloatArray | None,
        starts: IntArray,
        length: int,
        initial: FloatArray,
        parameters: FloatArray,
        substeps: int,
    ) -> tuple[Any, ...]:
        model = self.system.model
        if inputs.ndim != 2 or inputs.shape[1] != len(model.inputs):
            raise ModelError(
                f"{model.name}: found inputs of shape {inputs.shape}, expected"
                f" {len(model.inputs)} columns: {', '.join(model.inputs)}"
            )
        if len(starts) and (starts.min() < 0 or starts.max() + length > len(inputs)):
            raise ModelError(f"{model.name}: found a window beyond the recording's end")
        first = np.ascontiguousarray(initial, np.float64)
        # The kernels check no index.
        if first.size != len(starts) * len(self.system.states):
            raise ModelError(
                f"{model.name}: found {first.size} initial values, expected"
                f" {len(self.system.states)} for each of {len(starts)} windows"
            )
        first = first.reshape(len(starts), len(self.system.states))
        values = np.ascontiguousarray(parameters, np.float64)
        driven = np.ascontiguousarray(inputs, np.float64)
        hold = self.hold
        if self._late:
            driven = np.column_stack([driven[:, self._late], driven])
            hold = np.concatenate([hold[self._late], hold])
        spacing = np.ascontiguousarray(np.broadcast_to(dt, len(inputs)), np.float64)
        if begins is None:
            begins = np.zeros(len(inputs), np.int64)
        if time is None:
            time = elapsed(begins, spacing)
        return (driven, spacing, begins, time, substeps, hold, starts, first, values)

    def vector(self, values: Mapping[str, float]) -> FloatArray:
        """All parameters, with those in `values` replaced; shape (n_p,).

        Raises:
            ModelError: a name is not a parameter of the system.
        """
        names = list(self.system.parameters)
        vector = self.parameters
        for name, value in values.items():
            if name not in names:
                raise ModelError(
                    f"{self.system.model.name}: found parameter {name!r}, expected one of"
                    f" {', '.join(names)}"
                )
            vector[names.index(name)] = value
        return vector


def elapsed(begins: IntArray, spacing: FloatArray) -> FloatArray:
    """Time since the first sample of its recording at each sample, shape (n,) [s].

    Args:
        begins: that first sample, by sample, shape (n,).
        spacing: time from each sample to the next, shape (n,) [s].
    """
    return np.asarray((np.arange(len(begins)) - begins) * spacing, np.float64)


def compile_system(system: System) -> CompiledSystem:
    """`system` with its kernel; one without states is evaluated by NumPy."""
    kernel = native_kernel(system) if system.states else StaticKernel(system)
    return CompiledSystem(system, kernel)
