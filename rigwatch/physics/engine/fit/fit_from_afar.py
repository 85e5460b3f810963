"""The fitting driver: a fit that reaches the best parameters from wherever it is told to begin.

Over a long horizon the error of a simulation has valleys that lead nowhere: a mass of tons that
does not move, a spring so stiff that it follows nothing. So a fit begins at several places and the
best is kept:

1. the values that are given;
2. those that balance the equations along the measured motion, where channels show all states;
3. either of these over horizons that grow from a few samples to the whole, as each is a good start
   for the next (what is left of a short one has few valleys);
4. values drawn over the bounds, over growing horizons as well.

The later ones are tried only until two have come to the same error. A window that blows up is
shortened; a start that blows up even then is left.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.fit.convergence import (
    AGREE,
    PROMISED,
    Convergence,
    convergence,
    promise,
    spread,
)
from rigwatch.physics.engine.fit.drawn_starts import drawn_start
from rigwatch.physics.engine.fit.equation_error import equation_error_starts
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import Fit, error_at, fit
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


@dataclass(eq=False)
class _Search:
    """What is fitted, and the fits so far with what each began from."""

    compiled: CompiledSystem
    recording: Recording
    horizon: int
    scale: FloatArray
    noise: FloatArray | None
    initial: FloatArray | None
    substeps: int
    found: list[tuple[str, Fit]] = field(default_factory=list)
    trouble: ModelError | None = None

    @property
    def best(self) -> Fit:
        """The fit that leaves least."""
        return min((each for _, each in self.found), key=spread)

    @property
    def near_noise(self) -> bool:
        """Whether the best leaves little more than noise."""
        if self.noise is None or not self.found:
            return False
        if np.any(self.noise > QUIET * np.nanstd(self.recording.outputs, axis=0)):
            return False
        return float(np.sqrt(np.mean((self.best.rms / self.noise) ** 2))) <= NEAR

    @property
    def settled(self) -> bool:
        """Whether two fits have come to the same best error, and it is a minimum."""
        if len(self.found) < 2:
            return False
        least = spread(self.best)
        agreeing = sum(spread(each) <= AGREE * least for _, each in self.found)
        return agreeing > 1 and promise(self.best) <= PROMISED

    def attempt(self, name: str, start: FloatArray, *, growing: bool) -> None:
        """One more fit; nothing where it blows up."""
        try:
            if growing:
                start = self._grown(start)
            made = self._fit(self.horizon, start, self.initial)
        except ModelError as error:
            self.trouble = self.trouble or error
            return
        self.found.append((name, made))

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
        reached = False
        for length in growing_horizons(self.horizon):
            for shorter in (length, length // 2):
                try:
                    start = self._fit(max(shorter, 4), start).parameters
                except ModelError as error:
                    self.trouble = self.trouble or error
                else:
                    reached = True
                    break
        if not reached and growing_horizons(self.horizon):
            raise self.trouble or ModelError("no horizon can be simulated")
        return start

    def ending(self) -> tuple[Fit, Convergence]:
        """The best fit, and how it ended.

        Raises:
            ModelError: there is none.
        """
        if not self.found:
            assert self.trouble is not None
            raise self.trouble
        best = self.best
        begun = next(name for name, each in self.found if each is best)
        others = [each for _, each in self.found if each is not best]
        return best, convergence(best, others, begun, near_noise=self.near_noise)


def growing_horizons(horizon: int) -> list[int]:
    """Horizons before the last, the shortest first."""
    found: list[int] = []
    while horizon // GROWTH >= FEWEST:
        horizon //= GROWTH
        found.append(horizon)
    return found[::-1]


def fit_from_afar(
    compiled: CompiledSystem,
    recording: Recording,
    horizon: int,
    *,
    start: FloatArray | None = None,
    scale: FloatArray | None = None,
    noise: FloatArray | None = None,
    initial: FloatArray | None = None,
    substeps: int = 4,
) -> tuple[Fit, Convergence]:
    """The best of fits from several starts, and how it ended.

    Args:
        compiled: the system.
        recording: what it is fitted to.
        horizon: samples from one re-initialisation to the next.
        start: all parameters to begin with, shape (n_p,); the model's own if None.
        scale: divisor of each output's residuals, shape (outputs,); its standard deviation if None.
        noise: of the sensors, shape (outputs,); None where it is not known.
        initial: states that the search begins with, see `fit`.
        substeps: Runge-Kutta steps between samples, where nothing is stiff.

    Raises:
        ModelError: the recording is too short, or every start blows up.
    """
    begin = compiled.parameters if start is None else start
    size = np.nanstd(recording.outputs, axis=0) if scale is None else scale
    search = _Search(compiled, recording, horizon, size, noise, initial, substeps)
    attempts = _attempts(search, begin)
    for name, where, growing in attempts:
        search.attempt(name, where, growing=growing)
        if _enough(search):
            break
    return search.ending()


def _enough(search: _Search) -> bool:
    """Whether no further start is worth its time."""
    if not search.found:
        return False
    steep = promise(search.best) > PROMISED
    if not search.compiled.system.model.states or not search.compiled.system.free:
        return not steep
    return search.settled or (search.near_noise and not steep)


def _attempts(search: _Search, begin: FloatArray) -> Iterator[tuple[str, FloatArray, bool]]:
    """Starts, each with its name and whether its horizons grow, the likeliest first."""
    balanced, closer = _balanced(search, begin)
    given = ("the given values", begin, search.horizon >= LONG)
    if not closer:
        yield given
    if balanced is not None:
        yield "the balance of the equations", balanced, False
        if closer:
            yield given
        yield "the balance of the equations, growing horizons", balanced, True
    yield "the given values, growing horizons", begin, True
    if _numbers(search) < DEAR:
        generator = np.random.default_rng(0)
        for _ in range(DRAWN):
            yield "drawn values", drawn_start(search.compiled.system, begin, generator), True


def _balanced(search: _Search, begin: FloatArray) -> tuple[FloatArray | None, bool]:
    """Of the starts that balance the equations the one that simulates best over a short horizon.

    Returns:
        It, None where there is none; and whether it does better there than the given values.
    """
    starts = equation_error_starts(search.compiled, search.recording, begin)
    if not starts:
        return None, False
    errors = [_short_error(search, each) for each in starts]
    least = int(np.argmin(errors))
    if not np.isfinite(errors[least]):
        return None, False
    return starts[least], errors[least] < _short_error(search, begin)


def _short_error(search: _Search, parameters: FloatArray) -> float:
    """Scaled error over the second shortest of the growing horizons."""
    shorter = [*growing_horizons(search.horizon), search.horizon][:2][-1]
    return error_at(
        search.compiled, search.recording, shorter, parameters, search.scale, search.substeps
    )


def _numbers(search: _Search) -> int:
    """Numbers that one simulation with its sensitivities integrates."""
    columns = 1 + search.compiled.columns
    states = len(search.compiled.system.states)
    return len(search.recording) * search.substeps * states * columns
