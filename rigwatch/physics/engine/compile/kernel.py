"""The machine code of one system, and its kernel: the equations with the loops of `integrator`.

Functions of a system, each void(double t, double* a, u, p, out, slopes), with n states, m columns
of sensitivities and q probes; u holds the inputs, the time until each changes, if held, and the
fastest rate of a memory that the step allows:

    rates        a = [x | S], out = [dx/dt | dS/dt]
    step         a = [x | S] or x before and after a step of `rates` or `plain`: `step_function`
    read         a = [x | S], out = y, slopes = ∂y of shape (outputs, m)
    plain        a = x, out = dx/dt
    pace         a = x, out = required steps per second
    rate_slopes  a = x, out = dx/dt, slopes = ∂(dx/dt) by parameters, states, probes: (n, m + q)
    read_slopes  a = x, out = y, slopes = ∂y of shape (outputs, m + q)
    update       a = [x | S] before a sample, out = [x | S] after it
    update_slopes  a = x, out = x after the sample, slopes = ∂ of it, of shape (n, m + q)
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from threading import Lock
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import sympy

from rigwatch.physics.engine.compile import integrator as driver
from rigwatch.physics.engine.compile.all_cores import on_all_cores, shares
from rigwatch.physics.engine.compile.derivatives import Differentiated, differentiated
from rigwatch.physics.engine.compile.llvm import Function, literal, machine_code
from rigwatch.physics.engine.compile.runge_kutta_step import step_function
from rigwatch.physics.engine.compile.step_size import Pace, bounded_memory, pace
from rigwatch.physics.engine.compile.turns import alone, turn_given
from rigwatch.physics.engine.equations import TIME, UNTIL, System, symbol

LARGE = 300_000
"""Steps times integrated numbers above which a simulation is distributed over all cores."""
_COMPILING = Lock()


@dataclass(frozen=True)
class Equations:
    """The inputs of a kernel: equations without values, bounds or units.

    Attributes:
        states, inputs, parameters, free, probes: names; `free` are those of the parameters by which
            outputs are differentiated.
        rates, reads: of the states, and of the outputs.
        pace: rates that determine the step size.
        updates: all states after a sample; none without sampled states.
        memory: indices of the states that are no faster than a step allows.
        delays: of the first inputs, which arrive late: index of the parameter by which.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    free: tuple[str, ...]
    probes: tuple[str, ...]
    rates: tuple[sympy.Expr, ...]
    reads: tuple[sympy.Expr, ...]
    pace: Pace
    updates: tuple[sympy.Expr, ...] = ()
    memory: tuple[int, ...] = ()
    delays: tuple[int, ...] = ()


class Jacobians(NamedTuple):
    """Addresses of functions: a step of the rates; outputs, rates and updates with Jacobians."""

    step: int
    reads: int
    rates: int
    updates: int


def native_kernel(system: System) -> "NativeKernel":
    """The kernel of `system`, shared by all systems with the same equations."""
    return _kernel(
        Equations(
            tuple(system.states), (*system.delayed, *system.model.inputs), tuple(system.parameters),
            system.free, system.probes, tuple(system.derivatives.values()),
            tuple(system.outputs.values()), pace(system), _updates(system),
            tuple(map(list(system.states).index, bounded_memory(system))),
            tuple(list(system.parameters).index(own.parameter) for own in system.delayed.values()),
        )
    )  # fmt: skip


def _updates(system: System) -> tuple[sympy.Expr, ...]:
    if not system.updates:
        return ()
    return tuple(system.updates.get(name, symbol(name)) for name in system.states)


@lru_cache(maxsize=256)
def _kernel(equations: Equations) -> "NativeKernel":
    return NativeKernel(equations)


class NativeKernel:
    """A system's equations in machine code; the linearisation is compiled on first use."""

    def __init__(self, system: Equations) -> None:
        self._system, self._columns = system, len(system.free) + len(system.states)
        by = (system.states, system.free, system.probes)
        self._rates = differentiated(system.rates, *by)
        self._reads = differentiated(system.reads, *by)
        self._updates = differentiated(system.updates, *by)
        self._kept, self._along = list[Any](), (0, 0, 0, 0, 0)
        self._slopes: Jacobians | None = None
        self._sweeps: dict[int, tuple[int, int, int]] = {}
        self._crossing = np.array(system.pace.crossing, np.int64)
        self._delays = np.array(system.delays, np.int64)
        names = [system.parameters[index] for index in system.delays]
        free = system.free
        self._delay_columns = np.array(
            [free.index(n) if n in free else -1 for n in names], np.int64
        )

    def _compiled(self, functions: Sequence[Function], step: str = "") -> Any:
        with turn_given():
            kept, address = machine_code(functions, step)
        self._kept.append(kept)
        return address

    def _compiled_along(self) -> tuple[int, int, int, int, int]:
        """The functions of `simulate`, compiled by the first thread that asks."""
        if all(self._along):
            return self._along
        # SymPy is not made for several threads at once.
        with alone(_COMPILING):
            if not all(self._along):
                address = self._compiled([
                    *self._sensitive(self._columns),
                    self._plain_rates(),
                    _plain(self._system, "pace", self._system.pace.asked),
                    _with_sensitivities(
                        self._system, "update", self._updates, self._columns, behind=True
                    ),
                ], self._step(self._columns))  # fmt: skip
                names = ("step", "read", "plain", "pace", "update")
                step, read, plain, pace, update = (address(name) for name in names)
                self._along = (step, read, plain, pace, update)
        return self._along

    def simulate(  # noqa: PLR0917 -- they stand in the order of the driver's
        self, u: Any, spacing: Any, begins: Any, time: Any, substeps: Any, hold: Any, starts: Any,
        x0: Any, p: Any, y: Any, dy: Any, last: Any, rows: int, finest: int,
    ) -> None:  # fmt: skip
        """Fill outputs (windows, samples, outputs), their slopes (…, m) and the last [x | S]."""
        kernel = partial(
            driver.simulate, *self._compiled_along(), bool(self._system.updates),
            len(self._system.pace.asked), self._crossing, self._delays, self._delay_columns,
            self._columns, rows, u, spacing, begins, time, substeps, finest, hold,
        )  # fmt: skip
        numbers = x0.shape[1] * (1 + self._columns)
        # Starting threads costs more than a small simulation.
        large = starts.size * y.shape[1] * substeps * numbers >= LARGE
        # Windows are independent, so every distribution over cores gives the same numbers.
        with turn_given():
            on_all_cores(
                lambda c: kernel(starts[c], x0[c], p, y[c], dy[c], last[c]),
                shares(starts.size) if large else [slice(None)],
            )

    def _plain_rates(self) -> Function:
        slopes = {i: self._rates.by_state[i][i] for i in self._system.memory}
        return _plain(self._system, "plain", self._rates.values, slopes)

    def _step(self, columns: int) -> str:
        rates = "rates" if columns else "plain"
        inputs = len(self._system.inputs) + 2
        return step_function("step", rates, len(self._system.states), columns, inputs)

    def _sensitive(self, columns: int) -> tuple[Function, Function]:
        return (
            _with_sensitivities(
                self._system, "rates", self._rates, columns, self._system.memory, behind=True
            ),
            _with_sensitivities(self._system, "read", self._reads, columns, behind=False),
        )

    def with_sensitivities(self, columns: int) -> tuple[int, int]:
        """Addresses of `rates` and `read` for a number of columns of S, free parameters first.

        For custom loops; they are called through `integrator.call`.
        """
        return self._swept(columns)[:2]

    def step(self, columns: int) -> int:
        """Address of a whole step of the same, for `integrator.across`."""
        return self._swept(columns)[2]

    def _swept(self, columns: int) -> tuple[int, int, int]:
        if columns not in self._sweeps:
            address = self._compiled(self._sensitive(columns), self._step(columns))
            self._sweeps[columns] = (address("rates"), address("read"), address("step"))
        return self._sweeps[columns]

    def jacobians(self) -> Jacobians:
        """Addresses of the equations without sensitivities, and of their Jacobians."""
        if self._slopes is None:
            address = self._compiled([
                self._plain_rates(),
                _jacobian(self._system, "read_slopes", self._reads),
                _jacobian(self._system, "rate_slopes", self._rates, self._system.memory),
                _jacobian(self._system, "update_slopes", self._updates),
            ], self._step(0))  # fmt: skip
            self._slopes = Jacobians(
                step=address("step"),
                reads=address("read_slopes"),
                rates=address("rate_slopes"),
                updates=address("update_slopes"),
            )
        return self._slopes

    def linearise(  # noqa: PLR0917 -- they stand in the order of the driver's
        self, u: Any, spacing: Any, begins: Any, time: Any, substeps: Any, hold: Any, starts: Any,
        x0: Any, p: Any, nodes: Any, slopes: Any, y: Any, dy: Any, jumps: Any,
    ) -> None:  # fmt: skip
        """Fill the states at the nodes, the slopes of rates there, outputs and their slopes.

        `jumps` receives the Jacobian of the states across each sample, if states change there.
        """
        equations = self.jacobians()
        with turn_given():
            driver.linearise(
                *equations, self._delays, u, spacing, begins, time, substeps, hold, starts, x0, p,
                nodes, slopes, y, dy, jumps,
            )  # fmt: skip


def _function(system: Equations, name: str) -> Function:
    places: dict[sympy.Symbol, tuple[str, int] | None] = {symbol(TIME): None}
    for array, names in (
        ("a", system.states),
        ("u", system.inputs),
        ("p", system.parameters),
    ):
        places |= {symbol(each): (array, index) for index, each in enumerate(names)}
    places[symbol(UNTIL)] = ("u", len(system.inputs))
    return Function(name, places, {symbol(probe): 0.0 for probe in system.probes})


def _values(function: Function, expressions: Sequence[sympy.Expr]) -> Iterator[str | None]:
    """Registers of the expressions, with common subexpressions computed once; None for zero."""
    shared, reduced = sympy.cse(expressions, symbols=sympy.numbered_symbols("cse_"), order="none")
    for name, expression in shared:
        function.let(name, expression)
    return (None if e == 0 else function.value(e) for e in reduced)


def _with_sensitivities(
    system: Equations,
    name: str,
    found: Differentiated,
    m: int,
    memory: Sequence[int] = (),
    *,
    behind: bool,
) -> Function:
    """Values, and J·S + ∂/∂p in m columns, stored after the values or in `slopes`.

    The rates of `memory` are no faster than the step allows, and their rows alike: what they miss
    is the change of that share, which is small where the memory is near where it slips.
    """
    function, n, k = _function(system, name), len(system.states), len(found.values)
    if not k:
        return function
    # All expressions go through one common-subexpression elimination: values and derivatives
    # share most of their terms.
    flat = [*found.values, *(e for r in found.by_state for e in r)]
    flat += [e for r in found.by_parameter for e in r]
    values = _values(function, flat)
    plain = [next(values) or literal(0.0) for _ in range(k)]
    by_state = [[next(values) for _ in range(n)] for _ in range(k)]
    explicit = [[next(values) for _ in system.free] for _ in range(k)]
    into, first = ("out", k) if behind else ("slopes", 0)
    moved = [function.load_row("a", n + i * m, m) for i in range(n)]
    for i in range(k):
        row = function.row(explicit[i], m)
        for slope, of_state in zip(by_state[i], moved, strict=True):
            # Most entries of a Jacobian are zero and cost nothing.
            if slope is not None:
                row = function.add_scaled(row, slope, of_state, m)
        if i in memory:
            share = _share(function, system, plain[i], by_state[i][i])
            plain[i] = function.product(share, plain[i])
            row = function.add_scaled("zeroinitializer", share, row, m)
        function.store("out", i, plain[i])
        function.store_row(into, first + i * m, row, m)
    return function


def _share(function: Function, system: Equations, rate: str, slope: str | None) -> str:
    """Share of a memory's rate that a step allows: 1, or less if it or its slope is faster."""
    return function.share("u", len(system.inputs) + 1, (rate, slope or literal(0.0)))


def _plain(
    system: Equations,
    name: str,
    expressions: Sequence[sympy.Expr],
    memory: Mapping[int, sympy.Expr] = MappingProxyType({}),
) -> Function:
    """Values; those of `memory`, with their slopes by themselves, no faster than a step allows."""
    function, k = _function(system, name), len(expressions)
    values = [v or literal(0.0) for v in _values(function, [*expressions, *memory.values()])]
    slopes = dict(zip(memory, values[k:], strict=True))
    for index, value in enumerate(values[:k]):
        kept = value
        if index in memory:
            kept = function.product(_share(function, system, value, slopes[index]), value)
        function.store("out", index, kept)
    return function


def _jacobian(
    system: Equations, name: str, found: Differentiated, memory: Sequence[int] = ()
) -> Function:
    """Values in `out`; derivatives by free parameters, states and probes in `slopes`.

    Those of `memory` are no faster than the step allows.
    """
    function, k = _function(system, name), len(found.values)
    groups = list(zip(found.by_parameter, found.by_state, found.by_probe, strict=True))
    flat = [e for group in groups for row in group for e in row]
    values = [value or literal(0.0) for value in _values(function, [*found.values, *flat])]
    wide = len(flat) // max(k, 1)
    for index in range(k):
        row = values[k + index * wide : k + (index + 1) * wide]
        whole = [values[index], *row]
        if index in memory:
            own = row[len(system.free) + index]
            share = _share(function, system, values[index], own)
            whole = [function.product(share, each) for each in whole]
        function.store("out", index, whole[0])
        for at, slope in enumerate(whole[1:]):
            function.store("slopes", index * wide + at, slope)
    return function
