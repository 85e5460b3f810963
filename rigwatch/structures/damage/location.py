"""Locates a changed spring: tests every coefficient of every spring against the observation.

First pass: one linear sweep along the observed trajectory gives the residual and its derivative by
every candidate and every unknown first state at once (thesis 4.13, 4.14); the engine's score test
ranks the candidates. Second pass: the best few are refitted with unknown first states and ranked by
what they leave unexplained. Candidates form an indistinguishable class if their directions, with
the first states projected out, have a cosine above 0.95 and the data do not prefer the best: what
it explains beyond another is not significant.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from rigwatch.physics.engine.score import (
    ALIKE,
    Projector,
    Scores,
    Standing,
    cosines_with,
    freed,
    score,
    standings,
)
from rigwatch.structures.damage.refit import STEPS, Refit, Stretch
from rigwatch.structures.damage.spring_model import SpringModel, split
from rigwatch.wire.arrays import FloatArray

REFITTED = 4
"""Candidates of the first pass that are refitted."""
WORTH = 0.4
"""Share of the best candidate's score above which a candidate is refitted."""
CHANCE = float(chi2.isf(0.01, 1))
"""Largest χ² advantage of the best over others of its class."""
SCREENING = 6
"""Gauss-Newton steps per candidate; the best continues from there."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One coefficient as the place of the damage.

    Attributes:
        name: of the coefficient.
        spring: its spring.
        kind: stiffness, quadratic or cubic.
        score: χ²(1) of the first pass.
        p_value: of this score by chance, as the best of all candidates.
        before: its value in the undamaged structure.
        after: its value now, refitted if it was, else to first order.
        deviation: standard deviation of `after`; NaN if not refitted.
        chi2: χ² of the refit per degree of freedom; NaN if not refitted.
        alike: other candidates that the record cannot distinguish from it.
        refit: the whole refit.
    """

    name: str
    spring: str
    kind: str
    score: float
    p_value: float
    before: float
    after: float
    deviation: float
    chi2: float
    alike: tuple[str, ...]
    refit: Refit | None

    @property
    def words(self) -> str:
        """The change of the spring."""
        up = self.after > self.before
        return {
            "stiffness": "stiffer" if up else "softer",
            "quadratic": "one-sided",
            "cubic": "hardening" if up else "softening",
        }[self.kind]


@dataclass(frozen=True, eq=False)
class Ranking:
    """Candidates, the most likely first.

    Attributes:
        candidates: all of them.
        first, last: range of samples used, the last excluded.
        unseen: coefficients that hardly affect the record, however they change.
        second: the change simultaneous with the best; None if one change suffices.
    """

    candidates: tuple[Candidate, ...]
    first: int
    last: int
    unseen: tuple[str, ...]
    second: Candidate | None = None

    @property
    def best(self) -> Candidate:
        """The most likely one."""
        return self.candidates[0]

    @property
    def changed(self) -> tuple[Candidate, ...]:
        """The best candidate and the simultaneous change."""
        return (self.best,) if self.second is None else (self.best, self.second)


def locate(stretch: Stretch, path: FloatArray) -> Ranking:
    """Rank every coefficient of every spring as the place of the damage.

    Args:
        stretch: data after the damage, with the undamaged parameters.
        path: the undamaged model's states over the whole record, shape (samples, n).
    """
    model = stretch.model
    residual, rows, fitted, scores = scored(stretch, path)
    shifts = first_states(residual, rows, np.diag(scores.strength))
    state = model.shown_state(path, stretch.first)
    ranked = standings(model.candidates, scores, scores.corrected)
    listed = [_first_pass(stretch, standing) for standing in ranked]
    chosen = [c for c in listed[:REFITTED] if c.score >= WORTH * listed[0].score]
    places = {name: i for i, name in enumerate(model.candidates)}
    done = [_refitted(stretch, c, state + shifts[places[c.name]], SCREENING) for c in chosen]
    done.sort(key=lambda c: c.chi2)
    if done[0].refit is not None:
        done[0] = _refitted(stretch, done[0], done[0].refit.state)
    left = {c.name: c.refit.chi2 for c in done if c.refit is not None}
    best = _with_class(done[0], model, left)
    weak = _unseen(stretch, rows, fitted)
    return Ranking((best, *done[1:], *listed[len(chosen) :]), stretch.first, stretch.last, weak)


def unexplained(stretch: Stretch, path: FloatArray) -> float:
    """χ² that the best candidate leaves to first order; arguments as in `locate`."""
    scores = scored(stretch, path)[3]
    best = int(np.argmax(scores.score))
    return float(scores.score[best] * (1.0 / max(scores.explained[best], 1e-12) - 1.0))


def scored(stretch: Stretch, path: FloatArray) -> tuple[FloatArray, FloatArray, Projector, Scores]:
    """Scaled residual (k,), slopes (k, c + n), share of the first states, and the scores."""
    model = stretch.model
    errors, slopes = model.along_record(stretch.parameters, path, stretch.first, stretch.last)
    use, count = np.isfinite(errors), len(model.candidates)
    residual = (errors / stretch.sigma)[use]
    rows = (slopes / stretch.sigma[:, None])[use]
    fitted = Projector(np.zeros((1, len(rows), 0)), rows[None, :, count:])
    scores = score(residual[None], rows[None, :, :count], fitted, 1.0)
    return residual, rows, fitted, scores


def first_states(residual: FloatArray, rows: FloatArray, changes: FloatArray) -> FloatArray:
    """First-order change of the first states that goes with each column of changes, shape (k, n).

    Args:
        residual: scaled, shape (samples,).
        rows: scaled slopes by candidates and states, shape (samples, c + n).
        changes: of the candidates, shape (c, k).
    """
    count = len(changes)
    left = residual[:, None] - rows[:, :count] @ changes
    return np.asarray(np.linalg.lstsq(rows[:, count:], left, rcond=1e-10)[0].T)


def _first_pass(stretch: Stretch, found: Standing) -> Candidate:
    model, name = stretch.model, found.label
    before = model.value(stretch.parameters, name)
    spring, kind = split(name, model.structure)
    after, nan = before + found.strength, float("nan")
    return Candidate(
        name, spring, kind, found.score, found.p_value, before, after, nan, nan, (), None
    )


def _refitted(
    stretch: Stretch, candidate: Candidate, state: FloatArray, steps: int = STEPS
) -> Candidate:
    begin = max(candidate.after, 0.0) if candidate.kind == "stiffness" else candidate.after
    found = stretch.refit({candidate.name: begin}, state, steps)
    return replace(
        candidate,
        after=found.values[candidate.name],
        deviation=found.deviations[candidate.name],
        chi2=found.chi2 / max(found.freedom, 1),
        refit=found,
    )


def _with_class(best: Candidate, model: SpringModel, left: Mapping[str, float]) -> Candidate:
    """The best, with the candidates that resemble it along its refitted trajectory.

    Args:
        best: refitted.
        model: structure and record.
        left: χ² after the refits, by name.
    """
    if best.refit is None or not len(best.refit.slopes):
        return best
    count, place = len(model.candidates), model.candidates.index(best.name)
    slopes = best.refit.slopes
    unit = freed(slopes[:, :count], slopes[:, count:])
    cosines = cosines_with(unit, place)
    # The loss, to first order, if another direction replaces the best's.
    shares = (1.0 - cosines**2) * ((best.after - best.before) / max(best.deviation, 1e-300)) ** 2
    alike = []
    for i in np.argsort(-cosines).tolist():
        name = model.candidates[i]
        worse = left[name] - best.refit.chi2 if name in left else shares[i]
        if i != place and cosines[i] > ALIKE and worse < CHANCE:
            alike.append(name)
    return replace(best, alike=tuple(alike))


def _unseen(stretch: Stretch, rows: FloatArray, fitted: Projector) -> tuple[str, ...]:
    """Springs whose loss of a tenth of their stiffness the record would not show."""
    model, count = stretch.model, len(stretch.model.candidates)
    left = fitted.clean(rows[None, :, :count])
    size = np.linalg.norm(left, axis=0)
    limit = np.sqrt(chi2.isf(0.01 / count, 1))
    weak = []
    for index, name in enumerate(model.candidates):
        value = model.value(stretch.parameters, name)
        if name in model.structure.springs and 0.1 * abs(value) * size[index] < limit:
            weak.append(name)
    return tuple(weak)
