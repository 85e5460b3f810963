"""Remarks on fitted parameters that end far from where the study says that they are.

A value under `[start]` only begins the fit of a parameter that is fitted. While the model lacks
something, a parameter may stand for it: an inductance for the lag of a speed sensor, ten times as
large as the winding's. What is left may then be as little as with the right value, and only those
who know the machine can tell.
"""

import math
from dataclasses import replace

from rigwatch.wire.units import unit_of
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.fit import Value, shown

ORDER = math.sqrt(10.0)
"""Ratio of two values above which they are not of one order of magnitude, as which even a rough
starting value is meant."""
SAID = (
    "{name}: fitted to {fitted}, another order of magnitude than the {given} given under [start];"
    " it may stand for something that the model lacks; if that value is known, set"
    " `fixed = true` in the model's file"
)


def far_from_given(bench: Bench, found: dict[str, Value]) -> list[str]:
    """A remark on each fitted parameter of which the recordings refute the given value.

    Args:
        bench: the study.
        found: values of the fit with their intervals by name, in the units of the model's file.
    """
    said = []
    for name, given in bench.study.file.start.items():
        value = found.get(name)
        if value is None or value.interval is None:
            continue
        in_unit = unit_of(value.unit).from_si(given)
        if _of_another_order(in_unit, value.interval):
            told = shown(replace(value, value=in_unit, interval=None))
            said.append(SAID.format(name=name, fitted=shown(value), given=told))
    return said


def _of_another_order(given: float, interval: tuple[float, float]) -> bool:
    """Whether a whole interval is of another sign or order of magnitude than a value."""
    if not given:
        return False
    low, high = sorted(end / given for end in interval)
    return low > ORDER or high < 1 / ORDER
