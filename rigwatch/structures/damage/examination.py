"""Finds damage of a structure in a record: when, where, how much, and what follows.

The undamaged structure's model runs in parallel with the record. Once the residual exceeds noise,
only data from there on are used (a fit to the whole record mixes two structures, thesis 4.6.1): the
springs are ranked, the best is identified with unknown first states, and monitoring continues with
the changed model until the next damage.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rigwatch.structures.damage.detector import RATE, Alarm, Judge, Watch
from rigwatch.structures.damage.location import Ranking, locate, unexplained
from rigwatch.structures.damage.onset import Instant, instant
from rigwatch.structures.damage.pair_location import locate_pair
from rigwatch.structures.damage.refit import Refit, Stretch
from rigwatch.structures.damage.spring_model import SpringModel
from rigwatch.structures.damage.undamaged_reference import Figure, Reference, reference
from rigwatch.structures.identification import CONFIDENCE
from rigwatch.structures.model import Structure
from rigwatch.structures.records import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

LATE = 0.1
"""Largest share of the data after an alarm that lies between onset and alarm."""
STARTS = 5
"""Starts before the onset, and from onset to alarm, that are tried if an alarm is late."""
CLEAR = 0.01
"""Probability below which a candidate's score counts as significant."""
SHORTEST = 50
"""Fewest samples for an identification."""
MOST = 20
"""Number of damages after which the examination ends."""


@dataclass(frozen=True)
class Settings:
    """Settings of an examination.

    Attributes:
        undamaged: length of the undamaged start [s]; a fifth of the record if None.
        rate: probability of any false alarm over the record.
        limit: fixed limit of the residual instead, in the signals' units.
        settle: length of data for the first identification [s]; damages closer together
            count as one.
        known: take the file's values as true even if it marks them as unknown.
        moving: the structure moves at the first sample, instead of being as in the file.
    """

    undamaged: float | None = None
    rate: float = RATE
    limit: float | None = None
    settle: float = 2.0
    known: bool = False
    moving: bool = False


@dataclass(frozen=True, eq=False)
class Damage:
    """One damage.

    Attributes:
        alarm: time of detection [s].
        instant: time of the damage.
        ranking: candidate places, best first.
        figures: coefficients after it: those marked in the file and the changed one.
        before: the same coefficients before it.
        explained: whether one change, or two simultaneous ones, explain the data until the next.
        until: end of the data used to identify it [s].
    """

    alarm: float
    instant: Instant
    ranking: Ranking
    figures: Mapping[str, Figure]
    before: Mapping[str, Figure]
    explained: bool
    until: float


@dataclass(frozen=True, eq=False)
class Examination:
    """The result of an examination.

    Attributes:
        reference: the undamaged structure.
        settings: settings of the examination.
        watches: the first with the undamaged model, one more after each damage.
        damages: in order of time.
    """

    reference: Reference
    settings: Settings
    watches: tuple[Watch, ...]
    damages: tuple[Damage, ...]


def examine(
    structure: Structure,
    record: Record,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda _: None,
    model: SpringModel | None = None,
) -> Examination:
    """Search a record for damages.

    Args:
        structure: the undamaged structure.
        record: the measurement, undamaged at first.
        settings: settings of the examination.
        progress: called with a description of each step.
        model: of an earlier examination of the same structure, to reuse its kernel.

    Raises:
        ModelError: structure and record do not match, the undamaged start is too short, or a
            setting is out of range.
    """
    chosen = settings or Settings()
    _check(chosen)
    undamaged = chosen.undamaged or 0.2 * len(record) * record.dt
    progress(f"undamaged structure from the first {undamaged:g} s")
    base = reference(
        structure, record, undamaged, known=chosen.known, moving=chosen.moving, model=model
    )
    judge = Judge(base.sigma, base.freedom, chosen.rate, chosen.limit)
    work = _Search(base, judge, chosen, progress)
    work.run()
    return Examination(base, chosen, tuple(work.watches), tuple(work.damages))


def _check(settings: Settings) -> None:
    for name, value, good, expected in (
        ("false alarms", settings.rate, 0 < settings.rate < 1, "a probability between 0 and 1"),
        ("limit", settings.limit, settings.limit is None or settings.limit > 0, "one above 0"),
        ("settle", settings.settle, settings.settle > 0, "seconds above 0"),
    ):
        if not good:
            raise ModelError(f"{name}: found {value:g}, expected {expected}")


@dataclass(frozen=True, eq=False)
class _Estimate:
    """The structure as estimated from a sample on."""

    parameters: FloatArray
    state: FloatArray
    first: int
    spread: FloatArray
    figures: Mapping[str, Figure]
    learnt: int


@dataclass(eq=False)
class _Search:
    base: Reference
    judge: Judge
    settings: Settings
    progress: Callable[[str], None]
    watches: list[Watch] = field(default_factory=list)
    damages: list[Damage] = field(default_factory=list)

    def run(self) -> None:
        """Monitor, identify, monitor again, to the record's end."""
        base = self.base
        estimate = _Estimate(
            base.parameters, base.model.start(), 0, base.spread, base.figures, base.samples
        )
        while len(self.damages) < MOST:
            watch = self._watched(estimate)
            self.watches.append(watch)
            if watch.alarm is None or len(base.model) - watch.alarm.sample < SHORTEST:
                return
            estimate = self._identified(estimate, watch, watch.alarm)
            if not self.damages[-1].explained:
                # With a model known to be wrong, every sample would be an alarm.
                return

    def _watched(self, estimate: _Estimate) -> Watch:
        model = self.base.model
        watch = self.judge.watch(
            model,
            estimate.parameters,
            estimate.state,
            estimate.first,
            len(model),
            spread=estimate.spread,
            learnt=estimate.learnt,
        )
        # Innovations follow the record, and tell by themselves where they diverge.
        if self.judge.limit is not None or not np.any(estimate.spread):
            _check_bounded(model, watch)
        return watch

    def _identified(self, estimate: _Estimate, watch: Watch, alarm: Alarm) -> _Estimate:
        model, dt = self.base.model, self.base.model.dt
        self.progress(f"residual beyond its threshold at {alarm.sample * dt:g} s")
        path = np.concatenate([np.tile(estimate.state, (estimate.first, 1)), watch.states])
        begin = self._begin(estimate, path, watch, alarm)
        ranking, explained = self._located(estimate, path, begin)
        best = ranking.best
        places = [f"{c.name}: {c.before:g} -> {c.after:g}" for c in ranking.changed]
        self.progress(f"most likely {' and '.join(places)}")
        when = instant(model, self._changed(estimate, best.refit), watch, alarm, self.base.sigma)
        first = max(ranking.first, min(when.sample, ranking.last - SHORTEST))
        refit = self._refitted(estimate, path, ranking, first)
        figures = _figures(refit)
        before = {n: estimate.figures.get(n, self._taken(estimate, n)) for n in figures}
        self.damages.append(
            Damage(alarm.sample * dt, when, ranking, figures, before, explained, ranking.last * dt)
        )
        return _Estimate(
            self._changed(estimate, refit), refit.state, first, self._spread(refit),
            {**estimate.figures, **figures}, ranking.last,
        )  # fmt: skip

    def _begin(self, estimate: _Estimate, path: FloatArray, watch: Watch, alarm: Alarm) -> int:
        """First sample of the data to identify from.

        If the alarm is late the change is small, and the onset is only known to be earlier.
        The chosen start is the one from which a changed spring explains most of the undamaged
        model's residual: an earlier one mixes two structures, a later one wastes data.
        """
        end = len(self.base.model)
        if alarm.sample - alarm.onset <= LATE * (end - alarm.sample):
            return alarm.sample
        earliest = min(alarm.onset, max(estimate.first, self.base.samples))
        before = np.linspace(earliest, alarm.onset, STARTS)
        within = np.linspace(alarm.onset, alarm.sample, STARTS)
        starts = np.unique(np.concatenate([before, within]).astype(int)).tolist()
        squares = np.nansum((watch.residual / self.base.sigma) ** 2, axis=1)
        gains = [
            float(squares[first - watch.first :].sum())
            - unexplained(self._stretch(estimate, first, end), path)
            for first in starts
        ]
        return int(starts[int(np.argmax(gains))])

    def _stretch(self, estimate: _Estimate, first: int, last: int) -> Stretch:
        return Stretch(self.base.model, estimate.parameters, first, last, self.base.sigma)

    def _located(self, estimate: _Estimate, path: FloatArray, begin: int) -> tuple[Ranking, bool]:
        """Rank with more and more data while a change explains them, otherwise with less.

        Two simultaneous changes are considered only if a single one does not suffice.
        """
        end = len(self.base.model)
        length = max(SHORTEST, round(self.settings.settle / self.base.model.dt))
        shortest = min(length, end - begin) // 4
        kept: Ranking | None = None
        while True:
            # A remainder that is too short is joined to the data before it.
            last = end if begin + 1.5 * length > end else begin + length
            ranking, holds = self._ranked(estimate, path, begin, last)
            if not holds:
                if kept is not None:
                    return self._extended(estimate, path, kept), True
                if length // 2 < max(SHORTEST, shortest):
                    return ranking, False
                length //= 2
                continue
            kept = ranking
            if last == end:
                return ranking, True
            length *= 2

    def _ranked(
        self, estimate: _Estimate, path: FloatArray, begin: int, last: int
    ) -> tuple[Ranking, bool]:
        """One change, or else two simultaneous ones; and whether they explain the data."""
        stretch = self._stretch(estimate, begin, last)
        single = locate(stretch, path)
        if self._holds(estimate, single):
            return single, True
        pair = locate_pair(stretch, path, single)
        return (pair, True) if pair.second and self._holds(estimate, pair) else (single, False)

    def _extended(self, estimate: _Estimate, path: FloatArray, kept: Ranking) -> Ranking:
        """The ranking from all data until the next damage, if it holds there."""
        refit, end = kept.best.refit, len(self.base.model)
        if refit is None:
            return kept
        parameters, spread = self._changed(estimate, refit), self._spread(refit)
        watch = self.judge.watch(
            self.base.model,
            parameters,
            refit.state,
            kept.first,
            end,
            spread=spread,
            learnt=kept.last,
        )
        if watch.alarm is None or watch.alarm.onset <= kept.last:
            return kept
        ranking, holds = self._ranked(estimate, path, kept.first, watch.alarm.onset)
        return ranking if holds else kept

    def _holds(self, estimate: _Estimate, ranking: Ranking) -> bool:
        """Whether the change is significant and leaves only noise."""
        refit = ranking.best.refit
        chance = max(candidate.p_value for candidate in ranking.changed)
        if refit is None or not np.isfinite(refit.chi2) or chance > CLEAR:
            return False
        parameters = self._changed(estimate, refit)
        watch = self.judge.watch(
            self.base.model, parameters, refit.state, ranking.first, ranking.last
        )
        return watch.alarm is None

    def _refitted(
        self, estimate: _Estimate, path: FloatArray, ranking: Ranking, first: int
    ) -> Refit:
        """The changed coefficient and those marked in the file, from sample `first` on."""
        best, known = ranking.best, self.base.model.candidates
        marked = {n: f.value for n, f in estimate.figures.items() if n in known}
        state = path[first] if best.refit is None or first != ranking.first else best.refit.state
        stretch = self._stretch(estimate, first, ranking.last)
        return stretch.refit({**marked, **{c.name: c.after for c in ranking.changed}}, state)

    def _changed(self, estimate: _Estimate, refit: Refit | None) -> FloatArray:
        return self.base.model.changed(estimate.parameters, refit.values if refit else {})

    def _taken(self, estimate: _Estimate, name: str) -> Figure:
        value = self.base.model.value(estimate.parameters, name)
        return Figure(value, float("nan"), float("nan"))

    def _spread(self, refit: Refit) -> FloatArray:
        """The refit's covariance, expanded to all coefficients and states."""
        count = len(self.base.model.candidates) + len(refit.state)
        spread = np.zeros((count, count))
        at = self.base.model.columns(refit.names)
        spread[np.ix_(at, at)] = refit.covariance
        return spread


def _check_bounded(model: SpringModel, watch: Watch) -> None:
    """Raises a `ModelError` if the model diverges without an alarm: what follows is not judged."""
    lost = np.flatnonzero(~np.isfinite(watch.states).all(axis=1))
    if len(lost) and (watch.alarm is None or watch.alarm.sample > watch.first + lost[0]):
        raise ModelError(
            f"{model.structure.name}: the model diverges (NaN or infinite) at"
            f" {(watch.first + int(lost[0])) * model.dt:g} s, expected one that stays bounded under"
            " the record's loads: look at its cubic and quadratic coefficients"
        )


def _figures(refit: Refit) -> dict[str, Figure]:
    return {
        name: Figure(
            value,
            value - CONFIDENCE * refit.deviations[name],
            value + CONFIDENCE * refit.deviations[name],
        )
        for name, value in refit.values.items()
    }
