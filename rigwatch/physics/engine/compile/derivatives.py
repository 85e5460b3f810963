"""Differentiates the equations of a system, and prints them as numba source for other kernels.

With states x (n), inputs u, parameters p of which m_p are free, and the sensitivities S =
∂x/∂(p_free, x(0)) of shape (n, m_p + n), the functions printed are

    dx/dt = f(t, x, u, p),   dS/dt = (∂f/∂x)·S + ∂f/∂p,   y = g,   ∂y = (∂g/∂x)·S + ∂g/∂p

and a step of the classical fourth-order Runge-Kutta method. Derivatives are SymPy's; a jump counts
as having none. Zero entries of the Jacobians are not printed.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy
from sympy.printing.pycode import PythonCodePrinter

from rigwatch.physics.engine.equations import UNTIL, System, symbol

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

    def _print_floor(self, expr: sympy.Expr) -> str:
        return f"math.floor({self._print(expr.args[0])})"

    _print_tanh = _print_exp = _print_log = _print_sin = _print_cos = _print_atan = _print_Function

    def _print_Pow(self, expr: sympy.Expr, **_: object) -> str:  # noqa: N802 -- SymPy's name
        if expr.exp == sympy.Rational(1, 2):
            return f"math.sqrt({self._print(expr.base)})"
        if expr.exp == sympy.Rational(-1, 2):
            return f"(1/math.sqrt({self._print(expr.base)}))"
        return str(super()._print_Pow(expr))


@dataclass(frozen=True)
class Differentiated:
    """Expressions with their derivatives: each row belongs to one expression.

    Attributes:
        values: the expressions, k of them.
        by_state, by_parameter, by_probe: k rows of derivatives; parameters are the free ones.
    """

    values: list[sympy.Expr]
    by_state: list[list[sympy.Expr]]
    by_parameter: list[list[sympy.Expr]]
    by_probe: list[list[sympy.Expr]]


def differentiated(
    expressions: Sequence[sympy.Expr],
    states: Iterable[str],
    free: Iterable[str],
    probes: Iterable[str],
) -> Differentiated:
    """The expressions with their derivatives by states, free parameters and probes, by name."""

    named = [e.free_symbols for e in expressions]

    def rows(names: Iterable[str]) -> list[list[sympy.Expr]]:
        symbols = [symbol(name) for name in names]
        return [
            [derivative(e, s) if s in among else sympy.Integer(0) for s in symbols]
            for e, among in zip(expressions, named, strict=True)
        ]

    return Differentiated(list(expressions), rows(states), rows(free), rows(probes))


def source(system: System) -> str:
    """The text of a module of numba functions of `system`: `rates`, `read` and `advance`."""
    title = ", ".join([system.model.name, *(str(p) for p in system.placements)])
    return "".join(
        [
            _HEAD.format(title=title),
            _function(system, "rates", "dx", "ds", list(system.derivatives.values())),
            _function(system, "read", "y", "dy", list(system.outputs.values())),
            _DRIVER,
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
    for name in (UNTIL, *system.probes):
        yield f"    _{name} = 0.0"


def _body(
    system: System, value: str, slope: str, expressions: Sequence[sympy.Expr]
) -> Iterator[str]:
    found = differentiated(expressions, system.states, system.free, ())
    by_state, by_parameter = found.by_state, found.by_parameter
    flat = [e for rows in ([expressions], by_state, by_parameter) for r in rows for e in r]
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
        for j, (entry, text) in enumerate(_with(row, rest)):
            if entry != 0:
                yield f"{slope}[{i}, {j}] += {text}"


def _chained(slope: str, i: int, row: Sequence[sympy.Expr], rest: Iterator[str]) -> Iterator[str]:
    """Row i of (∂f/∂x)·S, zero entries left out."""
    terms = [f"({text}) * s[{j}, k]" for j, (entry, text) in enumerate(_with(row, rest)) if entry]
    yield f"for k in range({slope}.shape[1]):"
    yield f"    {slope}[{i}, k] = {' + '.join(terms) or '0.0'}"


def _with(row: Sequence[sympy.Expr], rest: Iterator[str]) -> list[tuple[sympy.Expr, str]]:
    return [(entry, next(rest)) for entry in row]


@lru_cache(maxsize=1 << 14)
def derivative(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    """∂expression/∂by, with jumps counted as having none.

    Sums and products go term by term, as systems of one model share most of their terms.
    """
    if by not in expression.free_symbols:
        return sympy.Integer(0)
    if expression.is_Add:
        return sympy.Add(*(derivative(term, by) for term in expression.args))
    if expression.is_Mul:
        factors = expression.args
        moved = ((i, derivative(factor, by)) for i, factor in enumerate(factors))
        return sympy.Add(*(sympy.Mul(*factors[:i], d, *factors[i + 1 :]) for i, d in moved if d))
    return _by_rules(expression, by)


def _by_rules(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    steps = {step: sympy.Dummy(real=True) for step in expression.atoms(sympy.floor)}
    back = {dummy: step for step, dummy in steps.items()}
    slope = sympy.diff(expression.xreplace(steps), by).xreplace(back)
    if not slope.has(sympy.DiracDelta, sympy.Heaviside):
        return slope
    slope = slope.replace(sympy.DiracDelta, lambda *_: sympy.Integer(0))
    return slope.replace(sympy.Heaviside, lambda at, *_: sympy.Piecewise((1, at > 0), (0, True)))
