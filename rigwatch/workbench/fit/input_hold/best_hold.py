"""The hold that explains most, and its delay.

Of long recordings delays are sought on a part first: where none helps there, none does on the
whole, and one that helps is refined on the whole.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.fit.input_hold.hold_trials import HoldTrials, Tried, explains_more
from rigwatch.workbench.fit.input_hold.seen_held import seen_held
from rigwatch.workbench.fit.training import TrainingPart, part_of

AT_NOISE = 1.03
"""Ratio of error to sensor noise below which no delay is searched for."""
DELAYS = (0.25, 0.5, 0.75, 1.0)
"""Delays tried before the best is refined, as shares of a sample."""
FINE = 5e-4
"""Resolution of the delay, as a share of a sample."""
COARSE = 0.02
"""The same on a part of the training, from which it is refined on the whole."""
AROUND = 0.1
"""Distance from the delay that a part shows within which the whole is searched."""


def best_hold(trials: HoldTrials, line: Tried, noise: FloatArray) -> Tried:
    """The best hold; a line is tried.

    Args:
        trials: of the model.
        line: its fit with lines.
        noise: of the sensors, shape (outputs,).
    """
    kept = trials.fitted("zero", 0.0, line.fitted.train.values(), line.fitted)
    seen = seen_held(trials.study, trials.data)
    best = kept if seen or explains_more(kept.fitted, line.fitted) else line
    if trials.data.along_motion or _at_noise(best, noise):
        return best
    late = _best_delay(trials, kept)
    return late if late is not None and explains_more(late.fitted, best.fitted) else best


def _best_delay(trials: HoldTrials, kept: Tried) -> Tried | None:
    """The best delay; None if none helps.

    Args:
        trials: of the model.
        kept: its fit with a hold that is not delayed.
    """
    base, part = kept.fitted, _part(trials)
    start = base.train.values()
    if part is None:
        whole = _Delays(lambda late: trials.fitted("zero", late, start, base))
        near = whole.coarse(kept.size)
        return None if near is None else whole.finest(near, DELAYS[0], FINE)
    seen = part.of(base)
    short = _Delays(lambda late: trials.on_part(part, "zero", late, start, seen))
    # A fit to the part alone may leave a local minimum in which that to the whole has ended.
    near = short.coarse(replace(kept, fitted=seen).size)
    found = None if near is None else short.finest(near, DELAYS[0], COARSE)
    if found is None:
        return None
    near, begin = found.late, found.fitted.train.values()
    whole = _Delays(lambda late: trials.fitted("zero", late, begin, base))
    # A whole sample, as an end of the search, is not tried by it.
    whole.size(near)
    return whole.finest(near, AROUND, FINE)


def _part(trials: HoldTrials) -> TrainingPart | None:
    """The part of the training on which delays are tried; None if it has to be the whole.

    What is slow in a drive begins each stretch of a part with a state that is fitted there; whether
    a delay beside it shows on a part has not been judged.
    """
    ports = trials.study.model.ports
    slow = [each for each in trials.placements if each.effect.states]
    if any(ports[each.entry].kind != "sensor" for each in slow):
        return None
    return part_of(trials.study, trials.data)


class _Delays:
    """Delays that are tried.

    Args:
        fitted: the model with a delay, as a share of a sample; raises a `ModelError` if it cannot
            be fitted.
    """

    def __init__(self, fitted: Callable[[float], Tried]) -> None:
        self._fitted = fitted
        self._found = dict[float, Tried]()

    def size(self, late: float) -> float:
        """Error of a delay; infinite if it cannot be fitted."""
        late = float(late)
        try:
            self._found[late] = self._fitted(late)
        except ModelError:
            return float("inf")
        return self._found[late].size

    def coarse(self, without: float) -> float | None:
        """The best of `DELAYS`; None if none has an error below that of no delay.

        If no coarse step improves the error, no fine one does.
        """
        sizes = [self.size(late) for late in DELAYS]
        return DELAYS[int(np.argmin(sizes))] if min(sizes) < without else None

    def finest(self, near: float, width: float, resolution: float) -> Tried | None:
        """The best delay that was tried, after a search around one; None if no fit succeeds."""
        ends = (max(near - width, 1e-3), min(near + width, 1.0))
        minimize_scalar(self.size, bounds=ends, method="bounded", options={"xatol": resolution})
        return min(self._found.values(), key=lambda one: one.size, default=None)


def _at_noise(tried: Tried, noise: FloatArray) -> bool:
    return float(np.sqrt(np.mean((tried.fitted.train.rms / noise) ** 2))) < AT_NOISE
