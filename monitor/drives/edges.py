"""Edges of an input: steps that are large beside the largest that it has made lately."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

EDGE = 0.25
"""Step, relative to the largest, above which it is an edge."""
KEEPS = 0.9999
"""What is left of the largest after a sample."""
SHORTEST = 6.0
"""Interval above which a step is an edge, and not part of a smooth drive or of noise [samples]."""
LAST, LARGEST = range(2)
"""Carried figures: the last sample, and the largest step."""


@part()
def edge(sample: float, kept: FloatArray) -> float:
    """The step to this sample if it is an edge, otherwise 0."""
    step = sample - kept[LAST]
    kept[LAST] = sample
    kept[LARGEST] = max(KEEPS * kept[LARGEST], abs(step))
    return step if abs(step) > EDGE * kept[LARGEST] else 0.0
