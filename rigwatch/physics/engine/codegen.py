"""Prints a system as the source of a numba kernel that simulates it with exact sensitivities.

With states x (n), inputs u, parameters p of which m_p are free, and the sensitivities S =
∂x/∂(p_free, x(0)) of shape (n, m_p + n), the kernel integrates

    dx/dt = f(t, x, u, p),   dS/dt = (∂f/∂x)·S + ∂f/∂p,   y = g,   ∂y = (∂g/∂x)·S + ∂g/∂p

by the classical fourth-order Runge-Kutta method with fixed steps. Derivatives are SymPy's; a jump
counts as having none. Zero entries of the Jacobians are not printed.
"""

from collections.abc import Iterable, Iterator, Sequence

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
def simulate(u, dt, substeps, hold, starts, x0, p, y, dy):
    n, m, h = {n}, {m}, dt / substeps
    x, xs, dx, acc = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    s, ss = np.empty((n, m)), np.empty((n, m))
    ds, sacc = np.empty((n, m)), np.empty((n, m))
    us = np.empty(u.shape[1])
    for w in range(starts.size):
        x[:] = x0[w]
        s[:] = 0.0
        for i in range(n):
            s[i, m - n + i] = 1.0
        for k in range(y.shape[1]):
            row = starts[w] + k
            read(row * dt, x, u[row], p, s, y[w, k], dy[w, k])
            if k + 1 == y.shape[1]:
                break
            for step in range(substeps):
                acc[:] = 0.0
                sacc[:] = 0.0
                xs[:] = x
                ss[:] = s
                for stage in range(4):
                    weight = 1.0 if stage == 0 or stage == 3 else 2.0
                    share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                    place = (step + share) / substeps
                    for j in range(us.size):
                        us[j] = u[row, j] + hold * place * (u[row + 1, j] - u[row, j])
                    rates((row + place) * dt, xs, us, p, ss, dx, ds)
                    ahead = h if stage == 2 else 0.5 * h
                    for i in range(n):
                        acc[i] += weight * dx[i]
                        xs[i] = x[i] + ahead * dx[i]
                        for j in range(m):
                            sacc[i, j] += weight * ds[i, j]
                            ss[i, j] = s[i, j] + ahead * ds[i, j]
                for i in range(n):
                    x[i] += h / 6.0 * acc[i]
                    for j in range(m):
                        s[i, j] += h / 6.0 * sacc[i, j]
"""


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
            _DRIVER.format(n=n, m=m),
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


def _body(
    system: System, value: str, slope: str, expressions: Sequence[sympy.Expr]
) -> Iterator[str]:
    states = [symbol(name) for name in system.states]
    free = [symbol(name) for name in system.free]
    by_state = [[derivative(e, s) for s in states] for e in expressions]
    by_parameter = [[derivative(e, p) for p in free] for e in expressions]
    flat = [*expressions, *_flatten(by_state), *_flatten(by_parameter)]
    shared, reduced = sympy.cse(flat, symbols=sympy.numbered_symbols(""), order="none")
    printer = _Printer()
    for name, expression in shared:
        yield f"{printer.doprint(name)} = {printer.doprint(expression)}"
    rest = iter(printer.doprint(e) for e in reduced)
    for i, _ in enumerate(expressions):
        yield f"{value}[{i}] = {next(rest)}"
    for i, row in enumerate(by_state):
        yield from _chained(slope, i, row, rest)
    for i, row in enumerate(by_parameter):
        for j, entry in enumerate(row):
            text = next(rest)
            if entry != 0:
                yield f"{slope}[{i}, {j}] += {text}"
    yield "return"


def _chained(slope: str, i: int, row: Sequence[sympy.Expr], rest: Iterator[str]) -> Iterator[str]:
    """Row i of (∂f/∂x)·S, zero entries left out."""
    terms = [f"({text}) * s[{j}, k]" for j, (entry, text) in enumerate(_with(row, rest)) if entry]
    yield f"for k in range({slope}.shape[1]):"
    yield f"    {slope}[{i}, k] = {' + '.join(terms) or '0.0'}"


def _with(row: Sequence[sympy.Expr], rest: Iterator[str]) -> list[tuple[sympy.Expr, str]]:
    return [(entry, next(rest)) for entry in row]


def _flatten(rows: Iterable[Iterable[sympy.Expr]]) -> list[sympy.Expr]:
    return [entry for row in rows for entry in row]


def derivative(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    """∂expression/∂by, with jumps counted as having none."""
    slope = sympy.diff(expression, by)
    slope = slope.replace(sympy.DiracDelta, lambda *_: sympy.Integer(0))
    return slope.replace(sympy.Heaviside, lambda at, *_: sympy.Piecewise((1, at > 0), (0, True)))
