"""How far edges that jitter are from where they are read, as the residual shows.

An edge that is read a sample early or late leaves a response in the residual. A generator that
rounds the instants of its edges to those of sampling shows the same intervals, but all its edges
are where they are read, and leave nothing: to allow for the response would hide a fault of its
size. Only edges that jitter at the time tell the two apart. Those of a clock that slides past the
samples are all late alike between two jumps, which the lateness of the inputs takes away.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.signals import fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

SHOWN = 256.0
"""Samples of edges that jitter after which they have shown it, and memory of what they leave."""
USUAL = 2.0
"""Mean square of a healthy residual without errors of edges, relative to its variance: a little
more than it leaves on average.
"""
SAFE = 2.0
"""Ratio of the energy that is allowed for to the one that was found."""
LEFT, RESPONSE, FOR, WITHOUT, REFUTED = range(5)
"""Means of the residual's energy beyond the usual one and of that of the response to what is not
known, samples that they are of, samples without anything unknown, and the share of the response's
energy that is not there.
"""


def no_instants() -> FloatArray:
    """The figures at the start."""
    return np.zeros(REFUTED + 1)


@part()
def follow_instants(  # noqa: PLR0917 -- a kernel
    error: float, unsure: float, jitters: bool, healthy: float, judging: bool, kept: FloatArray
) -> None:
    """Learn from a sample without a fault.

    Args:
        error: its residual.
        unsure: response of the prediction to what is not known of the instants.
        jitters: whether edges jitter, so that the residual shows it.
        healthy: variance of the residual at the present motion if all instants are known.
        judging: whether the rig is judged: what is allowed for then does not grow, as a fault may.
        kept: the carried figures.
    """
    kept[WITHOUT] = kept[WITHOUT] + 1.0 if unsure == 0.0 else 0.0
    if kept[WITHOUT] >= SHOWN:
        fill(kept, 0.0)
    if not jitters:
        return
    kept[FOR] = min(kept[FOR] + 1.0, SHOWN)
    kept[LEFT] += (error**2 - USUAL * healthy - kept[LEFT]) / kept[FOR]
    kept[RESPONSE] += (unsure**2 - kept[RESPONSE]) / kept[FOR]
    if kept[FOR] < SHOWN or kept[RESPONSE] <= 0.0:
        return
    refuted = 1.0 - min(max(SAFE * kept[LEFT] / kept[RESPONSE], 0.0), 1.0)
    kept[REFUTED] = max(refuted, kept[REFUTED]) if judging else refuted


@part()
def still_unsure(unsure: float, kept: FloatArray) -> float:
    """The response to what is still not known of the instants."""
    return unsure * np.sqrt(1.0 - kept[REFUTED])
