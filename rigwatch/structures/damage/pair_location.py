"""Locates two springs that changed at the same moment, if no single change explains the data.

Along the observed trajectory the response is linear in every coefficient, so that all pairs are
judged by one regression (as `locate` judges single ones); the best few are refitted. A pair is
accepted only if each of its two changes is significant with the other included.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from rigwatch.physics.engine.score import ALIKE, best_of, cosines_with, freed
from rigwatch.structures.damage.location import (
    CHANCE,
    SCREENING,
    Candidate,
    Ranking,
    first_states,
    scored,
)
from rigwatch.structures.damage.refit import STEPS, Refit, Stretch
from rigwatch.wire.arrays import FloatArray

REFITTED = 6
"""Number of pairs that are refitted."""
PARALLEL = 0.999
"""Cosine above which two directions cannot be separated."""

Pair = tuple[int, int]


def locate_pair(stretch: Stretch, path: FloatArray, singles: Ranking) -> Ranking:
    """The ranking of single changes with the likeliest pair in front.

    Args:
        stretch: data after the damage, with the undamaged parameters.
        path: the undamaged model's states over the whole record, shape (samples, n).
        singles: ranking of the same stretch.

    Returns:
        The ranking, its `second` the other spring of the pair; `singles` if no pair is accepted.
    """
    residual, rows, _, scores = scored(stretch, path)
    pairs, strengths = _pairs(scores.units, scores.strength, residual)
    if not pairs:
        return singles
    state, names = stretch.model.shown_state(path, stretch.first), stretch.model.candidates
    done: list[tuple[Pair, Refit]] = []
    for pair, strength in zip(pairs, strengths, strict=True):
        shift = first_states(residual, rows, strength[:, None])[0]
        start = _start(stretch, [names[i] for i in pair], strength[list(pair)])
        done.append((pair, stretch.refit(start, state + shift, SCREENING)))
    done.sort(key=lambda one: one[1].chi2)
    best, refit = done[0]
    refit = stretch.refit(refit.values, refit.state, STEPS)
    left = {pair: one.chi2 for pair, one in done[1:]}
    return _ranked(stretch, singles, best, refit, left)


def _pairs(
    units: FloatArray, strength: FloatArray, residual: FloatArray
) -> tuple[list[Pair], list[FloatArray]]:
    """The likeliest pairs, best first, and the change of every coefficient with each."""
    count = len(strength)
    cosines, along = units.T @ units, units.T @ residual
    first, second = np.triu_indices(count, 1)
    cross = cosines[first, second]
    apart = np.maximum(1.0 - cross**2, 1e-12)
    a, b = along[first], along[second]
    gain = (a**2 + b**2 - 2 * cross * a * b) / apart
    seen = np.linalg.norm(units, axis=0) > 0
    told = seen[first] & seen[second] & (np.abs(cross) < PARALLEL)
    order = np.argsort(-np.where(told, gain, -1.0))[:REFITTED]
    size = np.where(strength != 0, along / np.where(strength != 0, strength, 1.0), 1.0)
    made: tuple[list[Pair], list[FloatArray]] = ([], [])
    for k in order[told[order]].tolist():
        change = np.zeros(count)
        i, j = int(first[k]), int(second[k])
        change[i] = (a[k] - cross[k] * b[k]) / apart[k] / size[i]
        change[j] = (b[k] - cross[k] * a[k]) / apart[k] / size[j]
        made[0].append((i, j))
        made[1].append(change)
    return made


def _start(stretch: Stretch, names: list[str], change: FloatArray) -> dict[str, float]:
    model, before = stretch.model, stretch.parameters
    values = {n: model.value(before, n) + float(c) for n, c in zip(names, change, strict=True)}
    return {n: max(v, 0.0) if n in model.structure.springs else v for n, v in values.items()}


def _ranked(
    stretch: Stretch, singles: Ranking, pair: Pair, refit: Refit, left: Mapping[Pair, float]
) -> Ranking:
    names = stretch.model.candidates
    listed = {c.name: c for c in singles.candidates}
    members = [_member(listed[names[i]], refit, len(names)) for i in pair]
    alike = _alike(stretch, pair, members, refit, left)
    members = [replace(m, alike=others) for m, others in zip(members, alike, strict=True)]
    members.sort(key=lambda m: m.p_value)
    rest = tuple(c for c in singles.candidates if c.name not in {m.name for m in members})
    return replace(singles, candidates=(*members, *rest), second=members[1])


def _member(single: Candidate, refit: Refit, count: int) -> Candidate:
    """One of a pair; its p-value is that of its change given the other, as the best of all."""
    after, deviation = refit.values[single.name], refit.deviations[single.name]
    score = ((after - single.before) / max(deviation, 1e-300)) ** 2
    alone = chi2.sf(score, 1)
    return replace(
        single,
        after=after,
        deviation=deviation,
        score=float(score),
        p_value=float(best_of(alone, count)),
        chi2=refit.chi2 / max(refit.freedom, 1),
        refit=refit,
    )


def _alike(
    stretch: Stretch, pair: Pair, members: list[Candidate], refit: Refit, left: Mapping[Pair, float]
) -> list[tuple[str, ...]]:
    """The possible substitutes of each member."""
    if not len(refit.slopes):
        return [(), ()]
    names, count = stretch.model.candidates, len(stretch.model.candidates)
    found: list[set[int]] = [set(), set()]
    for side, member in enumerate(members):
        other = refit.slopes[:, [pair[1 - side]]]
        unit = freed(refit.slopes[:, :count], np.hstack([refit.slopes[:, count:], other]))
        cosines = cosines_with(unit, pair[side])
        lost = (1.0 - cosines**2) * member.score
        found[side] |= set(np.flatnonzero((cosines > ALIKE) & (lost < CHANCE)).tolist())
    for rival, rest in left.items():
        if rest - refit.chi2 < CHANCE:
            # The other spring of the rival pair substitutes for the missing member.
            lacking = [side for side in (0, 1) if pair[side] not in rival]
            for side in lacking:
                found[side] |= set(rival)
    return [tuple(names[i] for i in sorted(places - set(pair))) for places in found]
