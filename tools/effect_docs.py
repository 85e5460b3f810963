"""Prints docs/effects.md from the library of effects: `make docs` writes it."""

from rigwatch.commands.catalogue.effect_table import listed, markdown
from rigwatch.physics.engine.equations import library

HEAD = """<!-- Printed by `make docs` from rigwatch/physics/effects. -->

# Effects of the library

{count} effects, each an expression at a port of a model ([models](models.md#ports)). `rigwatch
effects NAME` describes and draws one: force against position and speed, response to a step. "Looks
like" names effects that may explain the same recording; `rigwatch explain` reports when it cannot
distinguish them. Effects marked ° are rarer: a study tries them with `whole_library = true`,
and `explain` by itself where no usual one explains the error.

At a force port the expression is the added force as a function of the port's variables: `x` and `v`
motion, `L` load, `p` pressure or level, `T` temperature, `i` current, `psi` flux linkage. At a
signal it is the output signal as a function of the input signal `u`. An effect is tried only at
ports that have all its variables.
[Own effects](workbench.md#own-effects)

"""


def page() -> str:
    """The whole page."""
    return HEAD.format(count=len(library())) + markdown(listed())
