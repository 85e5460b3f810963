"""Prints a system as the source of a numba kernel that simulates it with exact sensitivities.

With states x (n), inputs u, parameters p of which m_p are free, and the sensitivities S =
∂x/∂(p_free, x(0)) of shape (n, m_p + n), the kernel integrates

    dx/dt = f(t, x, u, p),   dS/dt = (∂f/∂x)·S + ∂f/∂p,   y = g,   ∂y = (∂g/∂x)·S + ∂g/∂p

by the classical fourth-order Runge-Kutta method with fixed steps. Derivatives are SymPy's; a jump
counts as having none. Zero entries of the Jacobians are not printed.
"""

from collections.abc import Iterator, Sequence

import sympy
from sympy.printing.pycode import PythonCodePrinter

from rigwatch.physics.engine.scope import symbol
from rigwatch.physics.engine.system import System

_HEAD = '''"""Kernel of {title}; printed from its equations, not to be edited."""

import math

import numpy as np
from numba import njit


'''

_DRIVER = """
@njit(cache=True, error_model="numpy")
def advance(u, row, step, substeps, hold, dt, p, x, xs, dx, acc, s, ss, ds, sacc, us):
    n, m, h = x.size, s.shape[1], dt / substeps
    for stage in range(4):
        weight = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
        back = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
        place = step / substeps + back / dt
        for j in range(us.size):
            us[j] = u[row, j] + hold * place * (u[row + 1, j] - u[row, j])
        for i in range(n):
            xs[i] = x[i] + back * dx[i]
            for j in range(m):
                ss[i, j] = s[i, j] + back * ds[i, j]
        rates((row + place) * dt, xs, us, p, ss, dx, ds)
        for i in range(n):
            acc[i] = weight * dx[i] + (acc[i] if stage else 0.0)
            for j in range(m):
                sacc[i, j] = weight * ds[i, j] + (sacc[i, j] if stage else 0.0)
    for i in range(n):
        x[i] += acc[i]
        for j in range(m):
            s[i, j] += sacc[i, j]


@njit(cache=True, error_model="numpy")
def simulate(u, dt, substeps, hold, starts, x0, p, y, dy):
    n, m = {n}, {m}
    x, xs, dx, acc = np.empty(n), np.empty(n), np.zeros(n), np.empty(n)
    s, ss = np.empty((n, m)), np.empty((n, m))
    ds, sacc = np.zeros((n, m)), np.empty((n, m))
    us = np.empty(u.shape[1])
    for w in range(starts.size):
        for i in range(n):
            x[i] = x0[w, i]
            for j in range(m):
                s[i, j] = 1.0 if j == m - n + i else 0.0
        for k in range(y.shape[1]):
            row = starts[w] + k
            read(row * dt, x, u[row], p, s, y[w, k], dy[w, k])
            if k + 1 < y.shape[1]:
                for step in range(substeps):
                    advance(u, row, step, substeps, hold, dt, p, x, xs, dx, acc, s, ss, ds, sacc, us)


@njit(cache=True, error_model="numpy")
def linearise(u, dt, substeps, hold, starts, x0, p, nodes, slopes, y, dy):
    n, m, q = {n}, {m}, {q}
    x, xs, dx, acc = np.empty(n), np.empty(n), np.zeros(n), np.empty(n)
    s, ss, unit = np.zeros((n, m)), np.empty((n, m)), np.zeros((n, m + q))
    ds, sacc = np.zeros((n, m)), np.empty((n, m))
    us = np.empty(u.shape[1])
    for i in range(n):
        unit[i, m - n + i] = 1.0
    for w in range(starts.size):
        for i in range(n):
            x[i] = x0[w, i]
        for k in range(y.shape[1]):
            row, last = starts[w] + k, k + 1 == y.shape[1]
            read(row * dt, x, u[row], p, unit, y[w, k], dy[w, k])
            for step in range(1 if last else substeps):
                place = step / substeps
                for j in range(us.size):
                    ahead = 0.0 if last else u[row + 1, j] - u[row, j]
                    us[j] = u[row, j] + hold * place * ahead
                node = k * substeps + step
                for i in range(n):
                    nodes[w, node, i] = x[i]
                rates((row + place) * dt, x, us, p, unit, acc, slopes[w, node])
                if not last:
                    advance(u, row, step, substeps, hold, dt, p, x, xs, dx, acc, s, ss, ds, sacc, us)
"""  # noqa: E501


class _Printer(PythonCodePrinter):  # type: ignore[misc]
    """Python that numba understands, without the names of modules in front."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False})

    def _print_Symbol(self, expr: sympy.Symbol) -> str:  # noqa: N802 -- SymPy's name
        # In front of every name, so that none is taken for an array or a loop's counter.
        return f"_{expr.name}"

    def _print_sign(self, expr: sympy.Expr) -> str:
        return f"np.sign({self._print(expr.args[0])})"

    def _print_Abs(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return f"abs({self._print(expr.args[0])})"

    def _print_Function(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        arguments = ", ".join(self._print(argument) for argument in expr.args)
        return f"math.{type(expr).__name__}({arguments})"

    def _print_floor(self, expr: sympy.Expr) -> str:
        return f"math.floor({self._print(expr.args[0])})"

    _print_tanh = _print_exp = _print_log = _print_sin = _print_cos = _print_atan = _print_Function

    def _print_Pow(self, expr: sympy.Expr, **_: object) -> str:  # noqa: N802 -- SymPy's name
        if expr.exp == sympy.Rational(1, 2):
            return f"math.sqrt({self._print(expr.base)})"
        return str(super()._print_Pow(expr))


def source(system: System) -> str:
    """The text of the kernel module of `system`: `rates`, `read` and `simulate`."""
    n, m = len(system.states), len(system.free) + len(system.states)
    title = ", ".join([system.model.name, *(str(p) for p in system.placements)])
    return "".join(
        [
            _HEAD.format(title=title),
            _function(system, "rates", "dx", "ds", list(system.derivatives.values())),
            _function(system, "read", "y", "dy", list(system.outputs.values())),
            _DRIVER.format(n=n, m=m, q=len(system.probes)),
        ]
    )


def _function(
    system: System, name: str, value: str, slope: str, expressions: Sequence[sympy.Expr]
) -> str:
    """One function that fills `value` with the expressions and `slope` with their sensitivities."""
    lines = [
        '@njit(cache=True, error_model="numpy")',
        f"def {name}(_t, x, u, p, s, {value}, {slope}):",
        *_unpacked(system),
        *(f"    {line}" for line in _body(system, value, slope, expressions)),
        "",
        "",
    ]
    return "\n".join(lines) + "\n"


def _unpacked(system: System) -> Iterator[str]:
    for array, names in (
        ("x", system.states),
        ("u", system.model.inputs),
        ("p", system.parameters),
    ):
        for index, name in enumerate(names):
            yield f"    _{name} = {array}[{index}]"
    for name in system.probes:
        yield f"    _{name} = 0.0"


def _body(
    system: System, value: str, slope: str, expressions: Sequence[sympy.Expr]
) -> Iterator[str]:
    states = [symbol(name) for name in system.states]
    free = [symbol(name) for name in system.free]
    by_state = [[derivative(e, s) for s in states] for e in expressions]
    by_parameter = [[derivative(e, p) for p in free] for e in expressions]
    by_probe = [[derivative(e, symbol(name)) for name in system.probes] for e in expressions]
    flat = [
        e for rows in ([expressions], by_state, by_parameter, by_probe) for r in rows for e in r
    ]
    shared, reduced = sympy.cse(flat, symbols=sympy.numbered_symbols(""), order="none")
    printer = _Printer()
    for name, expression in shared:
        yield f"{printer.doprint(name)} = {printer.doprint(expression)}"
    rest = iter(printer.doprint(e) for e in reduced)
    for i, _ in enumerate(expressions):
        yield f"{value}[{i}] = {next(rest)}"
    for i, row in enumerate(by_state):
        yield from _chained(slope, i, row, rest)
    yield from _added(slope, by_parameter, rest, 0)
    first = len(free) + len(states)
    yield f"if {slope}.shape[1] > {first}:"
    yield "    pass"
    yield from (f"    {line}" for line in _added(slope, by_probe, rest, first))


def _added(
    slope: str, rows: Sequence[Sequence[sympy.Expr]], rest: Iterator[str], first: int
) -> Iterator[str]:
    """The explicit part of the derivatives, from column `first` on; zero entries left out."""
    for i, row in enumerate(rows):
        for j, (entry, text) in enumerate(_with(row, rest), start=first):
            if entry != 0:
                yield f"{slope}[{i}, {j}] += {text}"


def _chained(slope: str, i: int, row: Sequence[sympy.Expr], rest: Iterator[str]) -> Iterator[str]:
    """Row i of (∂f/∂x)·S, zero entries left out."""
    terms = [f"({text}) * s[{j}, k]" for j, (entry, text) in enumerate(_with(row, rest)) if entry]
    yield f"for k in range({slope}.shape[1]):"
    yield f"    {slope}[{i}, k] = {' + '.join(terms) or '0.0'}"


def _with(row: Sequence[sympy.Expr], rest: Iterator[str]) -> list[tuple[sympy.Expr, str]]:
    return [(entry, next(rest)) for entry in row]


def derivative(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    """∂expression/∂by, with jumps counted as having none."""
    steps = {step: sympy.Dummy(real=True) for step in expression.atoms(sympy.floor)}
    back = {dummy: step for step, dummy in steps.items()}
    slope = sympy.diff(expression.xreplace(steps), by).xreplace(back)
    slope = slope.replace(sympy.DiracDelta, lambda *_: sympy.Integer(0))
    return slope.replace(sympy.Heaviside, lambda at, *_: sympy.Piecewise((1, at > 0), (0, True)))
