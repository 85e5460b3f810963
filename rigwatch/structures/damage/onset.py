"""Dates a damage at a known place: positions and velocities are continuous there.

For each candidate instant τ the undamaged model runs until τ and the damaged one continues from its
state. The likeliest τ has the smallest sum of squared residuals over the noise; the 95 % interval
holds those whose sum is at most 3.84 above it. The sum rises and falls with the motion, so that
instants are tried densely, and as far back as they become likelier.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from rigwatch.structures.damage.detector import Alarm, Watch
from rigwatch.structures.damage.spring_model import SpringModel
from rigwatch.wire.arrays import FloatArray

FINE = 12
"""Instants that are tried, over the time from onset to alarm."""
ROOM, BEFORE = 20, 3
"""Fewest samples considered before the onset; and what is, over the time from onset to alarm."""
FURTHER = 2
"""Samples considered before those, over their number, as long as the likeliest is among them: where
a damage shows little, the residual falls back to noise after it, and the onset is far behind."""
MOST = 96
"""Instants tried in one of these steps back: a structure that never was the model's is likelier the
earlier it is damaged, up to the beginning of a long record."""
EXCLUDED = float(chi2.isf(0.05, 1))
"""Squared error over the noise above the least from which an instant is excluded."""
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
    late = alarm.sample - alarm.onset
    room, step = max(ROOM, BEFORE * late), max(late // FINE, 1)
    low, high = max(watch.first, alarm.onset - room), alarm.sample
    end = min(len(model), high + max(AFTER, (high - low) // 2))
    dating = _Dating(model, damaged, watch, sigma, end)
    dating.compare(low, high, step)
    known = high
    while low > watch.first and dating.best < known:
        known, low = low, max(watch.first, low - FURTHER * (high - low))
        dating.compare(low, known, max(step, (known - low) // MOST))
    while dating.is_coarse:
        before, after = dating.beside
        dating.compare(before, after, max((after - before) // FINE, 1))
    dt = model.dt
    return Instant(dating.best, dating.best * dt, dating.end(-1) * dt, dating.end(1) * dt)


class _Dating:
    """Instants that are tried, and the squared error of each.

    Args:
        model, damaged, watch, sigma: as for `instant`.
        last: sample before which all are compared.
    """

    def __init__(
        self, model: SpringModel, damaged: FloatArray, watch: Watch, sigma: FloatArray, last: int
    ) -> None:
        self._model, self._damaged, self._watch, self._sigma = model, damaged, watch, sigma
        self._last = last
        self._quiet = np.cumsum(np.nansum((watch.residual / sigma) ** 2, axis=1))
        self._costs: dict[int, float] = {}

    def compare(self, low: int, high: int, step: int) -> None:
        """Try every `step`-th instant of a range, both ends included."""
        for at in (*range(low, high, step), high):
            self._cost(at)

    @property
    def best(self) -> int:
        """The likeliest instant tried."""
        return min(self._costs, key=lambda at: self._costs[at])

    @property
    def likely(self) -> list[int]:
        """The instants tried that the data do not exclude, in order."""
        return [at for at in sorted(self._costs) if self._is_likely(at)]

    @property
    def beside(self) -> tuple[int, int]:
        """The instants tried next to the likeliest, before and after it."""
        tried, best = sorted(self._costs), self.best
        place = tried.index(best)
        return tried[max(place - 1, 0)], tried[min(place + 1, len(tried) - 1)]

    @property
    def is_coarse(self) -> bool:
        """Whether there are instants between the likeliest and those tried next to it."""
        before, after = self.beside
        return self.best - before > 1 or after - self.best > 1

    def end(self, side: int) -> int:
        """The first instant before (-1) or after (1) the likely ones that is excluded."""
        likely = self.likely
        inner = likely[0] if side < 0 else likely[-1]
        beyond = [at for at in self._costs if (at - inner) * side > 0]
        outer = min(beyond, key=lambda at: abs(at - inner), default=inner + side)
        while abs(outer - inner) > 1:
            middle = (inner + outer) // 2
            self._cost(middle)
            inner, outer = (middle, outer) if self._is_likely(middle) else (inner, middle)
        return outer

    def _is_likely(self, at: int) -> bool:
        return self._costs[at] <= min(self._costs.values()) + EXCLUDED

    def _cost(self, at: int) -> None:
        """The squared error over the noise if the damage was at this instant."""
        if at in self._costs:
            return
        watch = self._watch
        run = self._model.run(self._damaged, watch.states[at - watch.first], at, self._last)
        left = _squares(self._model.observed[at : self._last], run.outputs, self._sigma)
        self._costs[at] = left + float(self._quiet[at - watch.first])


def _squares(observed: FloatArray, outputs: FloatArray, sigma: FloatArray) -> float:
    """Sum of squares after the first sample; infinite if the simulation diverged.

    What was not observed counts nothing, and a simulation that is not a number has diverged.
    """
    known = np.isfinite(observed[1:])
    errors = ((observed - outputs) / sigma)[1:][known]
    found = float(errors @ errors)
    return found if np.isfinite(found) else float("inf")
