"""Differentiates the equations of a system exactly, with SymPy.

The derivative of a discontinuity is taken as zero, and so is that of a root of what is limited to
positive values, as of a flow under a pressure, where nothing is left of it: it would be infinite.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy

from rigwatch.physics.engine.equations import symbol


@dataclass(frozen=True)
class Differentiated:
    """Expressions with their derivatives, one row per expression.

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


@lru_cache(maxsize=1 << 14)
def derivative(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    """∂expression/∂by, with zero derivative at discontinuities.

    Sums and products are differentiated term by term, as systems of one model share most terms.
    """
    if by not in expression.free_symbols:
        return sympy.Integer(0)
    if expression.is_Add:
        return sympy.Add(*(derivative(term, by) for term in expression.args))
    if expression.is_Mul:
        factors = expression.args
        moved = ((i, derivative(factor, by)) for i, factor in enumerate(factors))
        return sympy.Add(*(sympy.Mul(*factors[:i], d, *factors[i + 1 :]) for i, d in moved if d))
    return (
        _by_chain(expression, by) if _has_doubtful_size(expression) else _by_rules(expression, by)
    )


def _has_doubtful_size(expression: sympy.Expr) -> bool:
    """Whether SymPy takes the size of something for that of a complex number, as of a root."""
    return any(not size.args[0].is_extended_real for size in expression.atoms(sympy.Abs))


def _by_chain(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    """The derivative by the chain rule, each argument taken as the real number that it is."""
    if isinstance(expression, sympy.Piecewise):
        return sympy.Piecewise(*((derivative(e, by), where) for e, where in expression.args))
    arguments = [sympy.Dummy(real=True) if by in a.free_symbols else a for a in expression.args]
    outer = expression.func(*arguments)
    back = dict(zip(arguments, expression.args, strict=True))
    return sympy.Add(*(
        _by_rules(outer, own).xreplace(back) * derivative(argument, by)
        for own, argument in back.items()
        if own != argument
    ))  # fmt: skip


def _by_rules(expression: sympy.Expr, by: sympy.Symbol) -> sympy.Expr:
    # SymPy leaves the derivative of floor unevaluated; as a constant its derivative is zero.
    steps = {step: sympy.Dummy(real=True) for step in expression.atoms(sympy.floor)}
    back = {dummy: step for step, dummy in steps.items()}
    slope = sympy.diff(expression.xreplace(steps), by).xreplace(back)
    slope = slope.replace(
        _is_of_ended_root, lambda root: sympy.Piecewise((root, root.base > 0), (0, True))
    )
    # A jump's impulse has no value at a sample, and a step needs one at zero. A choice in its place
    # would be folded with those in its argument, which takes SymPy minutes.
    if not slope.has(sympy.DiracDelta, sympy.Heaviside):
        return slope
    slope = slope.replace(sympy.DiracDelta, lambda *_: sympy.Integer(0))
    return slope.replace(sympy.Heaviside, lambda at, *_: sympy.Heaviside(at, 0))


def _is_of_ended_root(term: sympy.Expr) -> bool:
    """Whether a term is the slope of a root whose radicand has an end at zero, without its sign."""
    rooted = term.is_Pow and term.exp.is_negative and term.exp.is_integer is False
    return bool(rooted and term.base.has(sympy.Max, sympy.Min, sympy.Abs, sympy.Piecewise))
