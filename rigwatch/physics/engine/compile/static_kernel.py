"""Expressions as NumPy functions, and the kernel of a model that has no states.

Without states nothing is integrated, so nothing needs to be compiled either: a regression is ready
in milliseconds. The kernel has the functions that a compiled one has, with the same arguments.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, reduce
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.printing.numpy import NumPyPrinter

from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.equations import TIME, UNTIL, System, parse, symbol
from rigwatch.wire.arrays import FloatArray


def numpy_function(names: Sequence[str], expressions: Any) -> Callable[..., Any]:
    """A function of arrays called `names` that gives the expression, or a list of them."""
    several = isinstance(expressions, list | tuple)
    return _printed(tuple(names), tuple(expressions) if several else expressions)


@lru_cache(maxsize=1024)
def _printed(names: tuple[str, ...], expressions: Any) -> Callable[..., Any]:
    """The same; printing takes milliseconds, and few expressions come up once only."""
    ready = list(expressions) if isinstance(expressions, tuple) else expressions
    arguments = [symbol(name) for name in names]
    function = sympy.lambdify(arguments, ready, "numpy", printer=_Printer, cse=True)

    def quiet(*arguments: Any) -> Any:
        # All branches of a choice are computed, including one that divides by zero.
        with np.errstate(all="ignore"):
            return function(*arguments)

    return quiet


class _Printer(NumPyPrinter):  # type: ignore[misc]
    """Pairs instead of lists, whose members would all have to be of one shape."""

    def __init__(self, settings: dict[str, Any] | None = None) -> None:
        whole = {"fully_qualified_modules": False, "inline": True, "allow_unknown_functions": True}
        super().__init__(whole | (settings or {}))

    def _pairs(self, function: str, arguments: Sequence[sympy.Expr]) -> str:
        return str(reduce(lambda a, b: f"{function}({a}, {b})", map(self._print, arguments)))

    def _print_Max(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return self._pairs("maximum", expr.args)

    def _print_Min(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return self._pairs("minimum", expr.args)

    def _print_And(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return self._pairs("logical_and", expr.args)

    def _print_Or(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return self._pairs("logical_or", expr.args)

    def _print_ITE(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        condition, one, other = map(self._print, expr.args)
        return f"where({condition}, {one}, {other})"

    def _print_Heaviside(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        return f"where({self._print(expr.args[0])} > 0, 1.0, 0.0)"

    def _print_Piecewise(self, expr: sympy.Expr) -> str:  # noqa: N802 -- SymPy's name
        *choices, last = expr.args
        text = self._print(last.expr) if last.cond == sympy.true else "nan"
        rest = [last] if last.cond != sympy.true else []
        for choice in reversed([*choices, *rest]):
            text = f"where({self._print(choice.cond)}, {self._print(choice.expr)}, {text})"
        return text


def evaluated(
    text: str, signals: Mapping[str, FloatArray], values: Mapping[str, float], where: str
) -> FloatArray:
    """An expression along signals, for values of parameters; shape (n,).

    Args:
        text: the expression.
        signals: signals it may refer to, each of shape (n,).
        values: numbers that it may name.
        where: description of the expression, for errors.

    Raises:
        ModelError: it does not parse, or names something else.
    """
    names = [*signals, *values]
    expression = parse(text, {name: symbol(name) for name in names}, where)
    found = numpy_function(names, expression)(*signals.values(), *values.values())
    shape = next(iter(signals.values())).shape
    return np.asarray(np.broadcast_to(found, shape), np.float64)


class StaticKernel:
    """Outputs and their slopes of a system without states, as arrays over all samples."""

    def __init__(self, system: System) -> None:
        outputs = list(system.outputs.values())
        names = (TIME, *system.model.inputs, *system.parameters)
        at_rest = {symbol(name): 0 for name in (UNTIL, *system.probes)}
        by = [symbol(name) for name in (*system.free, *system.probes)]
        slopes = [derivative(output, s) for output in outputs for s in by]
        whole = [e.subs(at_rest) for e in (*outputs, *slopes)]
        self._function = numpy_function(names, whole)
        self._outputs, self._free, self._all = len(outputs), len(system.free), len(by)

    def _evaluate(
        self,
        u: FloatArray,
        time: FloatArray,
        starts: NDArray[np.int64],
        length: int,
        p: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        rows = starts[:, None] + np.arange(length)
        signals = [time[rows], *np.moveaxis(u[rows], -1, 0)]
        values = self._function(*signals, *p)
        whole = np.stack([np.broadcast_to(value, rows.shape) for value in values], axis=-1)
        slopes = whole[..., self._outputs :].reshape(*rows.shape, self._outputs, self._all)
        return whole[..., : self._outputs], slopes

    def simulate(  # noqa: PLR0917 -- the arguments of a compiled kernel
        self, u: Any, _d: Any, _b: Any, time: Any, _s: Any, _h: Any, starts: Any, _x: Any, p: Any,
        y: Any, dy: Any, _l: Any, _r: Any, _f: Any,
    ) -> None:  # fmt: skip
        """Fill outputs (windows, samples, outputs) and their slopes by the free parameters."""
        y[:], slopes = self._evaluate(u, time, starts, y.shape[1], p)
        dy[:] = slopes[..., : self._free]

    def linearise(  # noqa: PLR0917 -- the arguments of a compiled kernel
        self, u: Any, _d: Any, _b: Any, time: Any, substeps: Any, _h: Any, starts: Any, _x: Any,
        p: Any, _nodes: Any, _slopes: Any, y: Any, dy: Any, _jumps: Any,
    ) -> None:  # fmt: skip
        """The same with the slopes by the probes behind those by the parameters."""
        del substeps
        y[:], dy[:] = self._evaluate(u, time, starts, y.shape[1], p)
