"""What channels show of a combination of states of which they show none by itself.

The travel of a strut is a difference of two positions: a channel measures it, but neither of them.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
import sympy

from rigwatch.physics.engine.compile import derivative
from rigwatch.physics.engine.equations import TIME, UNTIL, System, parse, symbol
from rigwatch.physics.engine.fit import Recording, rate_of_change
from rigwatch.wire.arrays import FloatArray

MOST_OPERATIONS = 40
"""Operations of an expression up to which it is compared with what channels show."""
SMOOTHED = 11
"""Samples over which a rate of change is computed, an odd number."""


class ShownSignals:
    """Expressions that are a multiple of what a channel measures, or of its rate of change.

    Args:
        system: a model without effects.
        recording: its channels.
    """

    def __init__(self, system: System, recording: Recording) -> None:
        self._system, self._recording = system, recording
        self._still = {symbol(name): sympy.Integer(0) for name in (*system.probes, UNTIL)}
        inputs = (*system.model.inputs, *system.delayed)
        names = (*system.states, *system.parameters, *inputs, TIME)
        self._names: Mapping[str, sympy.Expr] = {name: symbol(name) for name in names} | {
            name: expression.xreplace(self._still) for name, expression in system.ports.items()
        }

    def of(self, text: str, where: str) -> FloatArray | None:
        """The expression as channels show it, shape (n,); None if none does.

        Args:
            text: in the system's states, parameters, inputs and ports.
            where: what it defines, for errors.
        """
        wanted = parse(text, self._names, where)
        for read, (output, rate) in zip(self._recording.outputs.T, self._expressions, strict=True):
            share = _ratio(wanted, output)
            if share is not None:
                return np.asarray(share * read, np.float64)
            share = _ratio(wanted, rate)
            if share is not None:
                return share * self._rate_of_channel(read)
        return None

    @cached_property
    def _expressions(self) -> list[tuple[sympy.Expr, sympy.Expr]]:
        """What each channel shows, and its rate of change."""
        names = self._system.model.outputs
        shown = [self._system.outputs[name].xreplace(self._still) for name in names]
        return [(output, self._rate(output)) for output in shown]

    def _rate(self, expression: sympy.Expr) -> sympy.Expr:
        """Rate of change of an expression in the states."""
        moved = [name for name in self._system.states if symbol(name) in expression.free_symbols]
        terms = (derivative(expression, symbol(n)) * self._system.derivatives[n] for n in moved)
        return sympy.Add(*terms).xreplace(self._still)

    def _rate_of_channel(self, read: FloatArray) -> FloatArray:
        parts = zip(self._recording.slices, self._recording.own_spacings, strict=True)
        return np.concatenate([rate_of_change(read[part], SMOOTHED, dt) for part, dt in parts])


def _ratio(one: sympy.Expr, other: sympy.Expr) -> float | None:
    """The number by which one expression is a multiple of another; None if it is none."""
    if max(one.count_ops(), other.count_ops()) > MOST_OPERATIONS or not other.free_symbols:
        return None
    rational = one.is_rational_function() and other.is_rational_function()
    if not rational or one.free_symbols != other.free_symbols:
        return 1.0 if one == other else None
    ratio = sympy.cancel(one / other)
    return float(ratio) if ratio.is_number else None
