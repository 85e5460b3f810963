"""Dates a damage at a known place: positions and velocities are continuous there.

For each candidate instant τ the undamaged model runs until τ and the damaged one continues from its
state. The likeliest τ has the smallest sum of squared residuals over the noise; the 95 % interval
holds those whose sum is at most 3.84 above it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from rigwatch.structures.damage.detector import Alarm, Watch
from rigwatch.structures.damage.spring_model import SpringModel
from rigwatch.wire.arrays import FloatArray

TRIED = 13
"""Instants in each refinement round."""
ROOM = 20
"""Fewest samples considered before the onset."""
AFTER = 100
"""Samples compared after the alarm."""


@dataclass(frozen=True)
class Instant:
    """The time of a damage.

    Attributes:
        sample: the last one before it.
        time: of this sample [s].
        low, high: 95 % interval [s].
    """

    sample: int
    time: float
    low: float
    high: float


def instant(
    model: SpringModel, damaged: FloatArray, watch: Watch, alarm: Alarm, sigma: FloatArray
) -> Instant:
    """The likeliest instant.

    Args:
        model: structure and record.
        damaged: parameters after the damage, shape (n_p,).
        watch: the undamaged model's run over the record.
        alarm: of that watch.
        sigma: standard deviation of each signal's noise, shape (m,).
    """
    room = max(ROOM, 3 * (alarm.sample - alarm.onset))
    low, high = max(watch.first, alarm.onset - room), alarm.sample
    end = min(len(model), high + max(AFTER, (high - low) // 2))
    quiet = np.cumsum(np.nansum((watch.residual / sigma) ** 2, axis=1))
    costs: dict[int, float] = {}
    span, centre = (low, high), high
    while True:
        for at in np.unique(np.linspace(*span, TRIED).round().astype(int)).tolist():
            if at not in costs:
                run = model.run(damaged, watch.states[at - watch.first], at, end)
                costs[at] = _cost((model.observed[at:end] - run.outputs) / sigma)
                costs[at] += float(quiet[at - watch.first])
        centre = min(costs, key=lambda at: costs[at])
        step = (span[1] - span[0]) / (TRIED - 1)
        if step <= 1:
            break
        span = (max(low, round(centre - 1.5 * step)), min(high, round(centre + 1.5 * step)))
    near = [at for at, cost in costs.items() if cost <= costs[centre] + chi2.isf(0.05, 1)]
    dt = model.dt
    return Instant(centre, centre * dt, (min(near) - 1) * dt, (max(near) + 1) * dt)


def _cost(errors: FloatArray) -> float:
    """Sum of squares after the first sample; infinite if the simulation diverged."""
    found = float(np.nansum(errors[1:] ** 2))
    return found if np.isfinite(found) else float("inf")
