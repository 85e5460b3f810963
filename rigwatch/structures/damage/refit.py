"""Fits spring coefficients over a stretch of a record whose first state is unknown.

Gauss-Newton with the kernel's exact sensitivities; the states at the stretch's first sample are
unknowns in addition to the coefficients (thesis 4.6.1: "the case of unknown initial conditions").
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.structures.damage.spring_model import SpringModel
from rigwatch.structures.identification import solve
from rigwatch.wire.arrays import FloatArray

STEPS = 15
HALVINGS = 6
SETTLED = 1e-3
"""Negligible change of a step, in standard deviations."""
HUGE = 1e12
"""Standard deviations beyond which a simulation counts as diverged."""
GAIN = 1e-3
"""Share of the error that a step must remove unless its parameters are already precise."""


@dataclass(frozen=True, eq=False)
class Refit:
    """The result of a fit.

    Attributes:
        names: the fitted coefficients.
        values: by name.
        deviations: standard deviations by name.
        state: at the first sample, shape (n,).
        covariance: of coefficients and state, shape (names + n, names + n).
        chi2: sum of the squared residuals over their standard deviations.
        freedom: valid samples minus unknowns.
        slopes: scaled derivatives by all coefficients and states at the solution, shape (k, c + n).
    """

    names: tuple[str, ...]
    values: Mapping[str, float]
    deviations: Mapping[str, float]
    state: FloatArray
    covariance: FloatArray
    chi2: float
    freedom: int
    slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Stretch:
    """The part of a record to fit.

    Attributes:
        model: the structure with its record.
        parameters: values of those that are not fitted, shape (n_p,).
        first, last: samples, the last excluded.
        sigma: standard deviation of each signal's noise, shape (m,).
    """

    model: SpringModel
    parameters: FloatArray
    first: int
    last: int
    sigma: FloatArray

    def refit(self, start: Mapping[str, float], state: FloatArray, steps: int = STEPS) -> Refit:
        """Fit the coefficients in `start`, and the first state.

        Args:
            start: initial guesses, by name.
            state: initial guess of the first state, shape (n,).
            steps: most Gauss-Newton steps.
        """
        names = tuple(start)
        columns = self.model.columns(names)
        now = np.concatenate([np.array(list(start.values())), state])
        errors, slopes = self._errors(names, now)
        if not _finite(errors, slopes):
            return self._lost(names, now)
        cost, weight = _cost(errors), np.ones(len(errors))
        for _ in range(steps):
            step = solve(errors, slopes[..., columns], weight, np.ones(errors.shape[1]))
            found = self._shorter(names, now, step.change, cost)
            if found is None:
                break
            change = np.abs(found[0] - now)
            gain = 1.0 - found[3] / max(cost, 1e-300)
            now, errors, slopes, cost = found
            size = np.sqrt(np.maximum(np.diag(step.covariance), 1e-300))
            if gain < GAIN and np.all((change <= SETTLED * size) | (change <= 1e-7 * np.abs(now))):
                break
        return self._result(names, now, errors, slopes)

    def _errors(self, names: Sequence[str], now: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scaled errors (samples, m) and slopes (samples, m, c + n)."""
        values = dict(zip(names, now.tolist(), strict=False))
        parameters = self.model.changed(self.parameters, values)
        run = self.model.run(parameters, now[len(names) :], self.first, self.last)
        errors = (self.model.observed[self.first : self.last] - run.outputs) / self.sigma
        return errors, run.slopes / self.sigma[:, None]

    def _shorter(
        self, names: Sequence[str], now: FloatArray, change: FloatArray, cost: float
    ) -> tuple[FloatArray, FloatArray, FloatArray, float] | None:
        """The step, halved until the error falls; None if nothing is gained."""
        for _ in range(HALVINGS):
            moved = now + change
            for place, name in enumerate(names):
                if name in self.model.structure.springs:
                    # A stiffness stays positive.
                    moved[place] = max(moved[place], 0.0)
            errors, slopes = self._errors(names, moved)
            if _finite(errors, slopes) and (found := _cost(errors)) <= cost:
                return moved, errors, slopes, found
            change = change / 2
        return None

    def _lost(self, names: tuple[str, ...], now: FloatArray) -> Refit:
        """The result of a fit whose simulation diverges (NaN or infinite)."""
        values = dict(zip(names, now.tolist(), strict=False))
        blank = np.zeros((0, len(self.model.candidates) + len(self.model.start())))
        unknown = dict.fromkeys(names, float("inf"))
        size = np.full((len(now), len(now)), np.nan)
        return Refit(names, values, unknown, now[len(names) :], size, float("inf"), 1, blank)

    def _result(
        self, names: tuple[str, ...], now: FloatArray, errors: FloatArray, slopes: FloatArray
    ) -> Refit:
        columns = self.model.columns(names)
        weight, ones = np.ones(len(errors)), np.ones(errors.shape[1])
        last = solve(errors, slopes[..., columns], weight, ones, least_variance=1.0)
        deviations = np.sqrt(np.maximum(np.diag(last.covariance), 0.0))
        use = np.isfinite(errors)
        return Refit(
            names,
            dict(zip(names, now[: len(names)].tolist(), strict=True)),
            dict(zip(names, deviations[: len(names)].tolist(), strict=True)),
            now[len(names) :],
            last.covariance,
            _cost(errors),
            int(use.sum()) - len(columns),
            slopes[use],
        )


def _finite(errors: FloatArray, slopes: FloatArray) -> bool:
    """Whether a simulation stayed small enough to be squared."""
    return bool(np.isfinite(slopes).all() and np.nanmax(np.abs(errors), initial=0.0) < HUGE)


def _cost(errors: FloatArray) -> float:
    valid = errors[~np.isnan(errors)]
    return float(valid @ valid)
