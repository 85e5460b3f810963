"""Where a fit over short horizons begins, so that it ends at the best parameters.

Over a long horizon the error of a simulation has valleys that lead nowhere: a mass of tons that
does not move, a spring so stiff that it follows nothing. So a fit begins at several places:

1. the values that are given;
2. those that balance the equations along the measured motion, where channels show all states;
3. either of these over horizons that grow from a few samples to the whole, as each is a good start
   for the next (what is left of a short one has few valleys);
4. values drawn over the bounds, over growing horizons as well.

The later ones are tried only until two have come to the same error. A window that blows up is
shortened.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.fit import Fit, Recording, error_at, fit
from rigwatch.physics.engine.search.convergence import AGREE, PROMISED, promise, spread
from rigwatch.physics.engine.search.drawn_starts import drawn_start
from rigwatch.physics.engine.search.equation_error import equation_error_starts
from rigwatch.physics.engine.search.fit_from_afar import Attempt
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

NEAR = 2.0
"""Error over the sensors' noise up to which no other end of a fit could be much better."""
QUIET = 0.1
"""Noise over what a sensor reads up to which a fit that leaves no more than noise says much."""
GROWTH = 4
"""A horizon over the one before."""
FEWEST = 8
"""Samples of the shortest horizon."""
DRAWN = 4
"""Starts that are drawn at most."""
DEAR = 1_500_000
"""Numbers integrated in one simulation from which no start is drawn."""
LONG = 2000
"""Samples of a horizon from which a fit goes by way of shorter ones from the outset."""


@dataclass(frozen=True, eq=False)
class ShortHorizons:
    """What `fit_from_afar` searches over windows.

    Attributes:
        compiled: the system.
        recording: what it is fitted to.
        horizon: samples from one re-initialisation to the next.
        start: all parameters to begin with, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        noise: of the sensors, shape (outputs,); None where it is not known.
        initial: states that the search begins with, see `fit`.
        substeps: Runge-Kutta steps between samples, where nothing is stiff.
    """

    compiled: CompiledSystem
    recording: Recording
    horizon: int
    start: FloatArray | None = None
    scale: FloatArray | None = None
    noise: FloatArray | None = None
    initial: FloatArray | None = None
    substeps: int = 4

    def attempts(self) -> Iterator[Callable[[], Attempt]]:
        """Starts, the likeliest first."""
        for name, where, growing in self._starts():
            yield partial(self._attempt, name, where, growing=growing)

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether two have come to the same best error, or it is noise, and it is a minimum."""
        best = min(found, key=lambda each: each.cost)
        steep = promise(best.fit) > PROMISED
        system = self.compiled.system
        agreeing = sum(each.error <= AGREE * best.error for each in found)
        fixed = not system.model.states or not system.free
        return not steep and (fixed or agreeing > 1 or self.near_noise(best))

    def near_noise(self, best: Attempt) -> bool:
        """Whether the best leaves little more than noise."""
        if self.noise is None or np.any(
            self.noise > QUIET * np.nanstd(self.recording.outputs, axis=0)
        ):
            return False
        return float(np.sqrt(np.mean((best.fit.rms / self.noise) ** 2))) <= NEAR

    def _starts(self) -> Iterator[tuple[str, FloatArray, bool]]:
        """Each with its name and whether its horizons grow."""
        begin = self.compiled.parameters if self.start is None else self.start
        balanced, closer = self._balanced(begin)
        given = ("the given values", begin, self.horizon >= LONG)
        if not closer:
            yield given
        if balanced is not None:
            yield "the balance of the equations", balanced, False
            if closer:
                yield given
            yield "the balance of the equations, growing horizons", balanced, True
        yield "the given values, growing horizons", begin, True
        if self._numbers() < DEAR:
            generator = np.random.default_rng(0)
            for _ in range(DRAWN):
                yield "drawn values", drawn_start(self.compiled.system, begin, generator), True

    def _attempt(self, name: str, start: FloatArray, *, growing: bool) -> Attempt:
        if growing:
            start = self._grown(start)
        found = self._fit(self.horizon, start, self.initial)
        return Attempt(name, found, spread(found), spread(found))

    def _fit(self, horizon: int, start: FloatArray, initial: FloatArray | None = None) -> Fit:
        return fit(
            self.compiled, self.recording, horizon, start=start, scale=self.scale,
            initial=initial, substeps=self.substeps,
        )  # fmt: skip

    def _grown(self, start: FloatArray) -> FloatArray:
        """Parameters to which horizons lead that grow up to the last but one.

        Raises:
            ModelError: even the shortest blows up.
        """
        trouble: ModelError | None = None
        reached = False
        for length in growing_horizons(self.horizon):
            for shorter in (length, length // 2):
                try:
                    start = self._fit(max(shorter, 4), start).parameters
                except ModelError as error:
                    trouble = trouble or error
                else:
                    reached = True
                    break
        if trouble and not reached:
            raise trouble
        return start

    def _balanced(self, begin: FloatArray) -> tuple[FloatArray | None, bool]:
        """Of the starts that balance the equations the best one over a short horizon.

        Returns:
            It, None where there is none; and whether it does better there than the given values.
        """
        starts = equation_error_starts(self.compiled, self.recording, begin)
        if not starts:
            return None, False
        errors = [self._short_error(each) for each in starts]
        least = int(np.argmin(errors))
        if not np.isfinite(errors[least]):
            return None, False
        return starts[least], errors[least] < self._short_error(begin)

    def _short_error(self, parameters: FloatArray) -> float:
        """Scaled error over the second shortest of the growing horizons."""
        shorter = [*growing_horizons(self.horizon), self.horizon][:2][-1]
        return error_at(
            self.compiled, self.recording, shorter, parameters, self.scale, self.substeps
        )

    def _numbers(self) -> int:
        """Numbers that one simulation with its sensitivities integrates."""
        columns = 1 + self.compiled.columns
        states = len(self.compiled.system.states)
        return len(self.recording) * self.substeps * states * columns


def growing_horizons(horizon: int) -> list[int]:
    """Horizons before the last, the shortest first."""
    found: list[int] = []
    while horizon // GROWTH >= FEWEST:
        horizon //= GROWTH
        found.append(horizon)
    return found[::-1]
