"""A port whose variables contain what enters there, as the current that its own voltage sends.

What enters is the solution of `w = f(w)`. Effects that take a part in proportion, such as a series
resistance, make `f` affine in `w`, and the solution is exact. Others read their variables as they
would be without them: a drive that limits its current acts on the current that would flow.
"""

from collections.abc import Callable

import sympy


def solved(value: Callable[[sympy.Expr], sympy.Expr], own: sympy.Symbol) -> sympy.Expr | None:
    """What enters at a port by itself; None if that is not affine.

    Args:
        value: what enters, as a function of what its effects' variables contain of it.
        own: a symbol that stands for nothing else.
    """
    implicit = value(own)
    slope = sympy.diff(implicit, own)
    if slope.has(own):
        return None
    return implicit.xreplace({own: sympy.Integer(0)}) / (1 - slope)
