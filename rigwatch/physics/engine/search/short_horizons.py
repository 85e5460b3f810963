"""Starts of a fit over windows, chosen to reach the global minimum.

Over a long horizon the simulation error has spurious minima: a mass of tons that does not move, a
spring too stiff to respond. A fit is therefore started from several points:

1. the given values;
2. values that balance the equations along the measured motion, if channels measure all states; if
   they measure some, values with which these drive the others best;
3. any of these over horizons that grow from a few samples to the full one, each the start of the
   next (the error over a short horizon has few minima);
4. values drawn over the bounds, also over growing horizons.

A state that no channel shows is free in each window, the more so the shorter it is. There, a longer
horizon replaces the growing ones in 4, and the given values are tried that way too. Further starts
are tried only until two reach the same error. A diverging window is shortened.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, rate_limit
from rigwatch.physics.engine.fit import Fit, Recording, error_at, fit
from rigwatch.physics.engine.search.continued_fit import fit_continued
from rigwatch.physics.engine.search.convergence import PROMISED, spread
from rigwatch.physics.engine.search.drawn_starts import drawn_start
from rigwatch.physics.engine.search.equation_error import equation_error_starts
from rigwatch.physics.engine.search.hidden_states import continued_spread, has_hidden_states
from rigwatch.physics.engine.search.horizons import growing_horizons, longer_horizons
from rigwatch.physics.engine.search.motion_start import motion_start
from rigwatch.physics.engine.search.multi_start_fit import Attempt, agreeing
from rigwatch.physics.engine.search.promised_step import kept_promise
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

NEAR = 2.0
"""Ratio of error to sensor noise below which no other optimum could be much better."""
QUIET = 0.1
"""Largest ratio of noise to signal at which a fit at the noise level is conclusive."""
STANDS_IN = 2.0
"""Ratio of the error with hidden states continued to the error without, above which they stand in
for what the model lacks, and other starts are tried."""
DRAWN = 4
"""Most random starts."""
DRAWS = 100
"""Most values drawn for one of them, until the recording resolves the model's modes."""
DEAR = 1_500_000
"""Integrated numbers per simulation above which no random starts are tried."""
LONG = 2000
"""Horizon in samples above which a fit uses growing horizons from the outset."""


@dataclass(frozen=True, eq=False)
class ShortHorizons:
    """Search of `multi_start_fit` over windows.

    Attributes:
        compiled: the system.
        recording: the recording to fit.
        horizon: samples from one re-initialisation to the next.
        start: initial values of all parameters, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        noise: of the sensors, shape (outputs,); None if unknown.
        initial: initial states, see `fit`.
        substeps: Runge-Kutta steps between samples for non-stiff systems.
        continued: whether optima are compared with hidden states continued from window to window.
    """

    compiled: CompiledSystem
    recording: Recording
    horizon: int
    start: FloatArray | None = None
    scale: FloatArray | None = None
    noise: FloatArray | None = None
    initial: FloatArray | None = None
    substeps: int = 4
    continued: bool = False

    def attempts(self) -> Iterator[Callable[[], Attempt]]:
        """Attempts, most promising first."""
        for name, where, first in self._starts():
            yield partial(self._attempt, name, where, first)

    def enough(self, found: Sequence[Attempt]) -> bool:
        """Whether the best is a minimum and at noise level, or reached by two starts."""
        best = min(found, key=lambda each: each.cost)
        steep = best.gradient > PROMISED
        if self._continues and best.error > STANDS_IN * spread(best.fit):
            return False
        system = self.compiled.system
        fixed = not system.model.states or not system.free
        return not steep and (fixed or agreeing(found, best) > 1 or self.near_noise(best))

    def near_noise(self, best: Attempt) -> bool:
        """Whether the best error is near the noise level."""
        if self.noise is None or np.any(
            self.noise > QUIET * np.nanstd(self.recording.outputs, axis=0)
        ):
            return False
        over = float(np.sqrt(np.mean((best.fit.rms / self.noise) ** 2)))
        continued = best.error / spread(best.fit) if self._continues else 1.0
        return over * continued <= NEAR

    @property
    def _continues(self) -> bool:
        return self.continued and has_hidden_states(self.compiled.system)

    def _starts(self) -> Iterator[tuple[str, FloatArray, Sequence[int]]]:
        """Starts with their names and the horizons over which they are fitted first."""
        begin = self.compiled.parameters if self.start is None else self.start
        growing = growing_horizons(self.horizon)
        balanced, closer = self._balanced(begin)
        driven, nearer = self._driven(begin)
        given = ("the given values", begin, growing if self.horizon >= LONG else [])
        if nearer and driven is not None:
            yield "the measured motion", driven, []
        if not closer:
            yield given
        if driven is not None and not nearer:
            yield "the measured motion", driven, []
        if balanced is not None:
            yield "the balance of the equations", balanced, []
            if closer:
                yield given
            yield "the balance of the equations, growing horizons", balanced, growing
        longer = longer_horizons(self.recording, self.horizon) if self._continues else []
        if longer:
            yield "the given values, a longer horizon first", begin, longer
        yield "the given values, growing horizons", begin, growing
        if self._numbers() < DEAR:
            generator = np.random.default_rng(0)
            for _ in range(DRAWN):
                yield "drawn values", self._drawn(begin, generator), longer or growing

    def _drawn(self, begin: FloatArray, generator: np.random.Generator) -> FloatArray:
        """A random start at which the recording resolves the model's modes, if one is found."""
        compiled = self.compiled
        limit = rate_limit(compiled, begin, self.recording.dt)
        for _ in range(DRAWS):
            found = drawn_start(compiled.system, begin, generator)
            if compiled.fastest(found) <= limit:
                break
        return found

    def _attempt(self, name: str, start: FloatArray, first: Sequence[int]) -> Attempt:
        if first:
            start = self._fitted_over(first, start)
        found = self._fit(self.horizon, start, self.initial, last=True)
        gradient = kept_promise(found, self.recording, self.horizon, self.substeps)
        error = spread(found)
        if self._continues:
            error = continued_spread(found, self.recording, self.horizon, self.substeps)
        return Attempt(name, found, error, error, gradient)

    def _fit(
        self,
        horizon: int,
        start: FloatArray,
        initial: FloatArray | None = None,
        *,
        last: bool = False,
    ) -> Fit:
        fitted = fit_continued if last and self.continued else fit
        return fitted(
            self.compiled, self.recording, horizon, start=start, scale=self.scale,
            initial=initial, substeps=self.substeps,
        )  # fmt: skip

    def _fitted_over(self, horizons: Sequence[int], start: FloatArray) -> FloatArray:
        """Parameters after fits over these horizons, one after the other.

        Raises:
            ModelError: even the shortest diverges.
        """
        trouble: ModelError | None = None
        reached = False
        for length in horizons:
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
        """The best equation-error start over a short horizon.

        Returns:
            The start, None if there is none; and whether it is better there than the given values.
        """
        starts = equation_error_starts(self.compiled, self.recording, begin)
        if not starts:
            return None, False
        errors = [self._short_error(each) for each in starts]
        least = int(np.argmin(errors))
        if not np.isfinite(errors[least]):
            return None, False
        return starts[least], errors[least] < self._short_error(begin)

    def _driven(self, begin: FloatArray) -> tuple[FloatArray | None, bool]:
        """The start along the measured motion.

        Returns:
            The start, None if there is none; and whether it is better over a short horizon than the
            given values. A force that a sensor does not show, as a constant one, may be far off
            there and is soon found.
        """
        noise = self.scale if self.noise is None else self.noise
        if noise is None:
            return None, False
        found = motion_start(self.compiled, self.recording, begin, noise, self.substeps)
        if found is None:
            return None, False
        return found, self._short_error(found) < self._short_error(begin)

    def _short_error(self, parameters: FloatArray) -> float:
        """Scaled error over the second shortest of the growing horizons."""
        shorter = [*growing_horizons(self.horizon), self.horizon][:2][-1]
        return error_at(
            self.compiled, self.recording, shorter, parameters, self.scale, self.substeps
        )

    def _numbers(self) -> int:
        """Number of integrated values in one simulation with sensitivities."""
        columns = 1 + self.compiled.columns
        states = len(self.compiled.system.states)
        return len(self.recording) * self.substeps * states * columns
