"""Input and output of every simulator of `simulation_speed`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import NDArray

from rigwatch.physics.engine.equations.scope import symbol
from rigwatch.physics.engine.equations.system import TIME, System
from rigwatch.wire.arrays import FloatArray

Result = tuple[FloatArray, FloatArray]
"""Outputs (windows, samples, outputs); slopes (windows, samples, outputs, columns)."""
Simulator = Callable[[], Result]


@dataclass(frozen=True, eq=False)
class Task:
    """One simulation of many windows.

    Attributes:
        name: for the table.
        system: the equations.
        inputs: shape (samples, inputs).
        dt: time between samples [s].
        starts: first sample of each window.
        length: samples in each window.
        initial: shape (windows, states).
        parameters: all of them, shape (n_p,).
        substeps: Runge-Kutta steps a sample.
    """

    name: str
    system: System
    inputs: FloatArray
    dt: float
    starts: NDArray[np.int64]
    length: int
    initial: FloatArray
    parameters: FloatArray
    substeps: int = 4

    @property
    def columns(self) -> int:
        """Free parameters, then states."""
        return len(self.system.free) + len(self.system.states)

    @property
    def hold(self) -> float:
        """1 for inputs that are linear between samples, 0 for held ones."""
        return 1.0 if self.system.model.hold != "zero" else 0.0

    def names(self) -> list[sympy.Symbol]:
        """Arguments of the equations: time, states, inputs, all parameters."""
        system = self.system
        whole = (TIME, *system.states, *system.model.inputs, *system.parameters)
        return [symbol(name) for name in whole]

    def rates(self) -> list[sympy.Expr]:
        """The states' rates."""
        return self._bare(list(self.system.derivatives.values()))

    def reads(self) -> list[sympy.Expr]:
        """The outputs."""
        return self._bare(list(self.system.outputs.values()))

    def _bare(self, expressions: list[sympy.Expr]) -> list[sympy.Expr]:
        probes = {symbol(name): 0 for name in self.system.probes}
        return [e.subs(probes) for e in expressions]

    def free(self) -> list[int]:
        """Indices of the free parameters among all."""
        names = list(self.system.parameters)
        return [names.index(name) for name in self.system.free]
